// SPDX-License-Identifier: Apache-2.0
// Submits a problem: from a file, an example or the editor. It is checked before it is sent. Errors of the server
// are shown at the same places.

import {create} from '@bufbuild/protobuf';
import examples from 'examples';
import {
  ComponentToleranceSchema,
  type GetCapabilitiesResponse,
  type SolveOptions,
  SolveOptionsSchema,
  SolveRequestSchema,
} from '../../generated/dlcs/v1/solver_pb';
import {h, replace, setText, show} from '../dom';
import {placeOf, type Option} from '../files/fields';
import {JsonError, lineOf, locate, parseJson, pathText} from '../files/json';
import {type ProblemFile, readProblem} from '../files/problem';
import type {FieldError} from '../files/schema';
import {bytes, duration} from '../format';
import {getCapabilities, solver} from '../rpc/clients';
import {errorText, violationsOf} from '../rpc/errors';
import {rememberGrid} from '../solve/memory';
import {predictJob, startJob} from '../solve/start';
import {streamed, StreamedSolve} from '../solve/stream';
import {analysisCard} from './analyze';
import {Editor} from './editor';
import type {View} from './page';

const analysisTimeout = 60_000;
const mostOutputs = 1001;
const fewestOutputs = 51;
// Limit of the numbers in a trajectory whose times the page chooses.
const mostNumbers = 4e6;
// The text is kept while another view is shown.
const draft = {text: examples[0].text};

interface Field {
  element: HTMLElement;
  input: HTMLInputElement | HTMLSelectElement;
  error: HTMLElement;
}

/** Absolute tolerances of options, or what is wrong with their text. */
type Absolute = Partial<Pick<SolveOptions, 'absoluteTolerance' | 'absoluteTolerances'>> | string;

/** Of "1e-9", or "x1=1e-9, i(L1)=1e-12"; both may be given. */
function parseAbsolute(text: string): Absolute {
  const result: Exclude<Absolute, string> = {absoluteTolerances: []};
  // A name may hold commas: v(a,b).
  const parts = /\s*(?:([^\d.\s][^=]*?)\s*=)?\s*([^,=]*?)\s*(?:,|$)/y;
  while (text !== '' && parts.lastIndex < text.length) {
    const from = parts.lastIndex;
    const [, name, value] = parts.exec(text) ?? [];
    const tolerance = Number(value || NaN);
    if (!(tolerance >= 0 && Number.isFinite(tolerance))) {
      return `is ${text.slice(from).trim()}; must be a number at least 0, or NAME=number, separated by commas`;
    }
    if (name === undefined) {
      result.absoluteTolerance = tolerance;
    } else {
      result.absoluteTolerances?.push(create(ComponentToleranceSchema, {name, tolerance}));
    }
  }
  return result;
}

export class SubmitView implements View {
  readonly title = 'Submit';
  readonly element: HTMLElement;
  private readonly editor: Editor;
  private readonly fields: {[option in Option]: Field};
  private readonly example: HTMLSelectElement;
  private readonly file = h('input', {type: 'file', id: 'file', accept: '.json,application/json'});
  private readonly notice = h('p', {class: 'note', role: 'status'});
  private readonly errors = h('div', {class: 'errors', role: 'alert', id: 'problem-errors'});
  private readonly storeless = h(
    'p',
    {class: 'card', hidden: true},
    'This server keeps no solves: it was started without --store. A solve is shown here while this tab is open.',
  );
  private readonly solve = h('button', {type: 'submit', class: 'main'}, 'Solve');
  private readonly check = h('button', {type: 'button'}, 'Check only');
  private readonly analyze = h('button', {type: 'button'}, 'Analyze');
  private readonly analysis = h('div', {'aria-live': 'polite'});
  private capabilities: GetCapabilitiesResponse | null = null;

  constructor() {
    this.editor = new Editor('problem', () => {
      draft.text = this.editor.text;
      this.clear();
    });
    this.editor.area.setAttribute('aria-describedby', 'problem-errors');
    this.editor.text = draft.text;
    this.example = h(
      'select',
      {id: 'example'},
      h('option', {value: ''}, 'Choose …'),
      examples.map(({name}, i) => h('option', {value: i}, name)),
    );
    this.example.addEventListener('change', () => {
      const chosen = examples[Number(this.example.value)];
      if (this.example.value !== '') this.take(chosen.text);
    });
    this.file.addEventListener('change', () => void this.open(this.file.files?.[0]));
    this.fields = {
      title: field('title', 'Title', h('input', {id: 'title', maxlength: 200}), 'The name in the file if empty.'),
      method: field('method', 'Method', h('select', {id: 'method'}, h('option', {value: 0}, 'auto')), ''),
      tolerance: field(
        'tolerance',
        'Tolerance',
        h('input', {id: 'tolerance', inputmode: 'decimal', placeholder: '1e-6'}),
        'The largest relative error that is allowed.',
      ),
      absolute: field(
        'absolute',
        'Absolute tolerance',
        h('input', {id: 'absolute', placeholder: 'none'}),
        'An error that is accepted too: a number, or NAME=number, ... of states, pairs and outputs.',
      ),
      steps: field(
        'steps',
        'Steps',
        h('input', {id: 'steps', inputmode: 'numeric'}),
        'Empty: chosen for the tolerance.',
      ),
      points: field(
        'points',
        'Output times',
        h('input', {id: 'points', inputmode: 'numeric', placeholder: 'auto'}),
        'How many, evenly spaced. Empty: up to 1001, or every step where steps are given. 0: every step.',
      ),
    };
    this.check.addEventListener('click', () => void this.submit((...parts) => this.predict(...parts)));
    this.analyze.addEventListener(
      'click',
      () => void this.submit((file, options) => this.askForAnalysis(file, options)),
    );
    const form = h(
      'form',
      {novalidate: true},
      h(
        'div',
        {class: 'tools'},
        h('span', {}, h('label', {for: 'example'}, 'Example'), this.example),
        h('span', {}, h('label', {for: 'file'}, 'File'), this.file),
      ),
      h(
        'div',
        {class: 'submit'},
        h('div', {}, h('label', {for: 'problem', class: 'heading'}, 'Problem'), this.editor.element, this.errors),
        h(
          'div',
          {class: 'options'},
          Object.values(this.fields).map((entry) => entry.element),
          h('div', {class: 'buttons'}, this.solve, this.check, this.analyze),
          this.notice,
        ),
      ),
    );
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      void this.submit((...parts) => this.send(...parts));
    });
    form.addEventListener('dragover', (event) => event.preventDefault());
    form.addEventListener('drop', (event) => {
      event.preventDefault();
      void this.open(event.dataTransfer?.files[0]);
    });
    this.element = h('div', {}, h('h1', {}, 'Submit a problem'), this.storeless, form, this.analysis);
    void this.start();
  }

  destroy(): void {
    draft.text = this.editor.text;
  }

  private async start(): Promise<void> {
    try {
      this.capabilities = await getCapabilities();
    } catch (error) {
      setText(this.notice, errorText(error));
      return;
    }
    show(this.storeless, this.capabilities.jobs === undefined);
    show(this.check, this.capabilities.jobs !== undefined);
    const select = this.fields.method.input;
    replace(
      select,
      this.capabilities.methods.map(({method, name, description}) =>
        h('option', {value: method, title: description}, name),
      ),
    );
  }

  private async open(file: File | undefined): Promise<void> {
    if (file !== undefined) this.take(await file.text());
    this.example.value = '';
  }

  private take(text: string): void {
    this.editor.text = text;
    draft.text = text;
    this.clear();
  }

  private clear(): void {
    replace(this.errors);
    replace(this.analysis);
    this.editor.mark([]);
    for (const option of Object.keys(this.fields) as Option[]) this.refuse(option, '');
    setText(this.notice, '');
  }

  private refuse(option: Option, text: string): void {
    const {input, error} = this.fields[option];
    setText(error, text);
    show(error, text !== '');
    input.setAttribute('aria-invalid', String(text !== ''));
  }

  // Reads the input and calls the action of a button with it.
  private async submit(act: (file: ProblemFile, options: SolveOptions, title: string) => Promise<void>): Promise<void> {
    this.clear();
    const file = this.readFile();
    const options = this.readOptions(file);
    if (file === null || options === null) return;
    const title = this.fields.title.input.value.trim() || file.name;
    const buttons = [this.solve, this.check, this.analyze];
    buttons.forEach((button) => (button.disabled = true));
    try {
      this.capabilities ??= await getCapabilities();
      await act(file, options, title);
    } catch (error) {
      this.showRefusal(error);
    } finally {
      buttons.forEach((button) => (button.disabled = false));
    }
  }

  private async send({system, horizon, grid}: ProblemFile, options: SolveOptions, title: string): Promise<void> {
    if (this.capabilities?.jobs === undefined) {
      if (streamed.solve?.running) {
        setText(this.notice, 'A solve of this tab is still running. Cancel it first, or use another tab.');
        return;
      }
      streamed.solve = new StreamedSolve(create(SolveRequestSchema, {system, options}), title, horizon, grid);
      location.hash = '#/solve';
      return;
    }
    const name = await startJob(create(SolveRequestSchema, {system, options, title, requestId: freshId()}));
    rememberGrid(name, grid);
    location.hash = `#/${name}`;
  }

  private async predict({system}: ProblemFile, options: SolveOptions, title: string): Promise<void> {
    const job = await predictJob(create(SolveRequestSchema, {system, options, title}));
    setText(
      this.notice,
      'The problem is valid. Predicted: ' +
        `${duration(job.predictedCoreSeconds)} of one core, ${bytes(job.predictedMemoryBytes)}.`,
    );
  }

  private async askForAnalysis({system}: ProblemFile, options: SolveOptions): Promise<void> {
    if (system.case !== 'problem') {
      setText(this.notice, 'Only linear problems can be analyzed before they are solved.');
      return;
    }
    setText(this.notice, 'Analyzing …');
    // Which times are output makes no difference, and the advice is about methods and steps.
    const asked = {...options, outputTimes: []};
    const analysis = await solver.analyzeProblem({problem: system.value, options: asked}, {timeoutMs: analysisTimeout});
    setText(this.notice, '');
    replace(this.analysis, analysisCard(analysis));
    this.analysis.scrollIntoView({block: 'nearest'});
  }

  private readFile(): ProblemFile | null {
    try {
      const {file, errors} = readProblem(this.editor.text);
      this.showErrors(errors);
      return file;
    } catch (error) {
      if (!(error instanceof JsonError)) throw error;
      const {line, column} = lineOf(this.editor.text, error.offset);
      this.listErrors([{line, column, offset: error.offset, text: error.message, path: ''}]);
      return null;
    }
  }

  private readOptions(file: ProblemFile | null): SolveOptions | null {
    const read = (option: Option) => this.fields[option].input.value.trim();
    let sound = true;
    const number = (option: Option, rule: string, allows: (value: number) => boolean) => {
      const text = read(option);
      const value = Number(text);
      if (text === '' || allows(value)) return value;
      this.refuse(option, `is ${text}; must be ${rule}`);
      sound = false;
      return 0;
    };
    const method = Number(read('method'));
    const errorTolerance = number('tolerance', 'from 1e-13 to below 1, such as 1e-8', (e) => e >= 1e-13 && e < 1);
    const absolute: Absolute = parseAbsolute(read('absolute'));
    if (typeof absolute === 'string') {
      this.refuse('absolute', absolute);
      sound = false;
    }
    const steps = number('steps', 'a whole number above 0', (n) => Number.isInteger(n) && n > 0 && n < 2 ** 31);
    const points = number(
      'points',
      'a whole number from 0 to 1000000',
      (n) => Number.isInteger(n) && n >= 0 && n <= 1e6,
    );
    if (!sound || typeof absolute === 'string' || file === null) return null;
    const numbers = Math.floor(mostNumbers / Math.max(1, file.states + 2 * file.pairs));
    const chosen = steps > 0 ? 0 : Math.min(mostOutputs, Math.max(fewestOutputs, numbers));
    return create(SolveOptionsSchema, {
      method,
      errorTolerance,
      ...absolute,
      grid: steps > 0 ? {case: 'steps', value: steps} : {case: undefined},
      outputTimes: evenTimes(read('points') === '' ? chosen : points, file.horizon),
    });
  }

  private showRefusal(error: unknown): void {
    const violations = violationsOf(error);
    const errors: FieldError[] = [];
    const others: string[] = violations.length === 0 ? [errorText(error)] : [];
    for (const {field: name, text} of violations) {
      const place = placeOf(name);
      if (place === null) {
        others.push(`${name}: ${text}`);
      } else if ('option' in place) {
        this.refuse(place.option, text);
      } else {
        errors.push({path: place.path, rule: text});
      }
    }
    this.showErrors(errors);
    this.errors.append(...others.map((text) => h('p', {class: 'error'}, text)));
  }

  private showErrors(errors: FieldError[]): void {
    if (errors.length === 0) return;
    const {text} = this.editor;
    parseJson(text);
    this.listErrors(
      errors.map(({path, rule}) => {
        const offset = locate(text, path);
        const whole = path.length === 0 && rule.startsWith('has ');
        return {...lineOf(text, offset), offset, path: pathText(path), text: whole ? `The problem ${rule}` : rule};
      }),
    );
  }

  private listErrors(errors: {line: number; column: number; offset: number; path: string; text: string}[]): void {
    this.editor.mark(errors.map(({line}) => line));
    replace(
      this.errors,
      h('p', {}, errors.length === 1 ? 'One thing is wrong:' : `${errors.length} things are wrong:`),
      h(
        'ul',
        {},
        errors.map(({line, column, offset, path, text}) =>
          h(
            'li',
            {},
            h(
              'button',
              {type: 'button', class: 'link', on: {click: () => this.editor.goTo(offset, line)}},
              `line ${line}, column ${column}`,
            ),
            ' ',
            path !== '' && h('code', {}, path),
            ' ',
            text,
          ),
        ),
      ),
    );
    this.editor.goTo(errors[0].offset, errors[0].line);
  }
}

function field(id: string, label: string, input: Field['input'], note: string): Field {
  const error = h('p', {class: 'error', id: `${id}-error`, role: 'alert', hidden: true});
  input.setAttribute('aria-describedby', `${id}-note ${id}-error`);
  const element = h(
    'div',
    {class: 'field'},
    h('label', {for: id}, label),
    input,
    h('p', {class: 'note', id: `${id}-note`}, note),
    error,
  );
  return {element, input, error};
}

function evenTimes(points: number, horizon: number): number[] {
  if (points < 2) return [];
  return Array.from({length: points}, (_, k) => (k === points - 1 ? horizon : (horizon * k) / (points - 1)));
}

// crypto.randomUUID exists in secure contexts only.
function freshId(): string {
  return [...crypto.getRandomValues(new Uint8Array(16))].map((byte) => byte.toString(16).padStart(2, '0')).join('');
}

// SPDX-License-Identifier: Apache-2.0
// Reads JSON strictly, and finds the place of a value in its text. JSON.parse does neither: it takes the last of two
// equal keys, and its messages differ between browsers.

export type Json = null | boolean | number | string | Json[] | JsonObject;
export type JsonObject = {[key: string]: Json};
export type Path = (string | number)[];

export class JsonError extends Error {
  constructor(
    message: string,
    readonly offset: number,
  ) {
    super(message);
  }
}

const deepest = 100;

export function isObject(value: Json | undefined): value is JsonObject {
  return typeof value === 'object' && value !== null && !Array.isArray(value);
}

export function parseJson(text: string): Json {
  if (text.trim() === '') throw new JsonError('the text is empty; paste a problem, open a file or take an example', 0);
  return new Parser(text).document();
}

/** The offset of the value at `path`, or of the innermost value around it that exists; `text` is valid JSON. */
export function locate(text: string, path: Path): number {
  const parser = new Parser(text, path);
  parser.document();
  return parser.found;
}

export function lineOf(text: string, offset: number): {line: number; column: number} {
  const before = text.slice(0, offset);
  return {line: before.split('\n').length, column: offset - before.lastIndexOf('\n')};
}

/** As messages write it: pieces[0].f, diagonals."-1". */
export function pathText(path: Path): string {
  return path
    .map((step, i) => {
      if (typeof step === 'number') return `[${step}]`;
      const key = /^[A-Za-z_$][\w$]*$/.test(step) ? step : `"${step}"`;
      return i === 0 ? key : `.${key}`;
    })
    .join('');
}

/** What a message calls a value. */
export function describe(value: Json): string {
  if (value === null) return 'null';
  if (typeof value === 'string') return `a string (${JSON.stringify(value.slice(0, 40))})`;
  if (typeof value === 'number') return `a number (${value})`;
  if (typeof value === 'boolean') return String(value);
  if (Array.isArray(value)) return value.length === 0 ? 'an empty list' : `a list (of ${value.length})`;
  return 'an object';
}

class Parser {
  found = 0;
  private at = 0;
  // How many steps of the wanted path lead to the value that is being read; -1 outside of that path.
  private matched = 0;

  constructor(
    private readonly text: string,
    private readonly wanted: Path = [],
  ) {}

  document(): Json {
    this.blanks();
    const value = this.value(0);
    this.blanks();
    if (this.at < this.text.length) this.fail('more text follows the end of the object');
    return value;
  }

  private fail(message: string, offset = this.at): never {
    throw new JsonError(message, offset);
  }

  private blanks(): void {
    while (this.at < this.text.length && ' \t\r\n'.includes(this.text[this.at])) ++this.at;
  }

  private value(depth: number): Json {
    if (this.matched === depth) this.found = this.at;
    if (depth > deepest) this.fail(`lists or objects are nested deeper than ${deepest}`);
    switch (this.text[this.at]) {
      case '{':
        return this.object(depth);
      case '[':
        return this.list(depth);
      case '"':
        return this.string();
      default:
        return this.word();
    }
  }

  // Reads what is inside of `step` of the value at `depth`.
  private inside(step: string | number, depth: number): Json {
    const before = this.matched;
    this.matched = before === depth && this.wanted[depth] === step ? depth + 1 : -1;
    const value = this.value(depth + 1);
    this.matched = before;
    return value;
  }

  private object(depth: number): JsonObject {
    const object: JsonObject = {};
    this.members('}', () => {
      if (this.text[this.at] !== '"') this.fail(this.explain());
      const start = this.at;
      const key = this.string();
      if (Object.hasOwn(object, key))
        this.fail(`the key "${key.slice(0, 40)}" is given twice; keep one of them`, start);
      this.blanks();
      if (this.text[this.at] !== ':') this.fail('a colon is missing after the key');
      ++this.at;
      this.blanks();
      // A plain assignment to "__proto__" would change the object instead of adding a key.
      const value = this.inside(key, depth);
      Object.defineProperty(object, key, {value, enumerable: true, configurable: true, writable: true});
    });
    return object;
  }

  private list(depth: number): Json[] {
    const list: Json[] = [];
    this.members(']', () => list.push(this.inside(list.length, depth)));
    return list;
  }

  private members(end: string, read: () => void): void {
    ++this.at;
    this.blanks();
    if (this.text[this.at] === end) {
      ++this.at;
      return;
    }
    for (;;) {
      read();
      this.blanks();
      const next = this.text[this.at];
      if (next === end) {
        ++this.at;
        return;
      }
      if (next !== ',') this.fail(this.at < this.text.length ? this.missingComma() : this.explain());
      ++this.at;
      this.blanks();
      if (this.text[this.at] === end) this.fail(`there is a comma before the closing '${end}'; remove it`);
    }
  }

  private missingComma(): string {
    return /^["[{0-9-]/.test(this.text[this.at]) ? 'a comma is missing before this' : this.explain();
  }

  private string(): string {
    const start = this.at;
    for (++this.at; this.at < this.text.length; ++this.at) {
      const letter = this.text[this.at];
      if (letter === '\\') ++this.at;
      if (letter === '\n') this.fail('the text is not closed by a quote on its line', start);
      if (letter !== '"') continue;
      ++this.at;
      try {
        return JSON.parse(this.text.slice(start, this.at)) as string;
      } catch {
        this.fail('the text holds a character that JSON does not allow; is a backslash doubled?', start);
      }
    }
    this.fail('the text ends in the middle; is a quote missing?', start);
  }

  private word(): Json {
    const token = /^[^\s,:[\]{}"]*/.exec(this.text.slice(this.at, this.at + 400))![0];
    if (token === 'true' || token === 'false' || token === 'null') {
      this.at += token.length;
      return JSON.parse(token) as Json;
    }
    if (!/^-?(0|[1-9]\d*)(\.\d+)?([eE][+-]?\d+)?$/.test(token)) this.fail(this.explain());
    const number = Number(token);
    if (!Number.isFinite(number)) this.fail(`${token.slice(0, 40)} is too large; every number must be finite`);
    this.at += token.length;
    return number;
  }

  // Why the text at the present place is not JSON.
  private explain(): string {
    const rest = this.text.slice(this.at, this.at + 40);
    if (rest === '') return 'the text ends in the middle; is a bracket or a quote missing?';
    const word = /^[-+]?[A-Za-z]+/.exec(rest)?.[0] ?? '';
    if (/^[-+]?(nan|inf|infinity)$/i.test(word)) return `${word} is not JSON; every number must be finite`;
    if (/^(true|false|none)$/i.test(word)) return `${word} is Python; JSON writes true, false and null`;
    if (word !== '') return `${word} is not a JSON value; text, formulas too, needs double quotes`;
    if (rest[0] === "'") return 'text in JSON needs double quotes, not single ones';
    if (rest[0] === '/' || rest[0] === '#') return 'JSON has no comments; put notes into the key "about"';
    if (/^[-+.0-9]/.test(rest)) return 'this is not a number that JSON allows; write 0.5, not .5, 5. or +5';
    return `a value cannot begin with ${rest[0]}`;
  }
}

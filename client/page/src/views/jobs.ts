// SPDX-License-Identifier: Apache-2.0
// The list of jobs: #/jobs. It is updated every second, row by row, so that the focus is kept.

import {type ListSolveJobsResponse, type SolveJob} from '../../generated/dlcs/v1/jobs_pb';
import {h, replace, setText, show} from '../dom';
import {ago, count, duration, milliseconds, timeLeft} from '../format';
import {canCancel, hasEnded, membersText, methodWord, statusOf, titleOf} from '../names';
import {getCapabilities, jobs, shortCall} from '../rpc/clients';
import {errorText} from '../rpc/errors';
import {pollWhileVisible, type View} from './page';

const pollEvery = 1_000;
const pageSize = 200;

export class JobsView implements View {
  readonly title = 'Solves';
  readonly element: HTMLElement;
  private readonly ended = new AbortController();
  private readonly search = h('input', {type: 'search', id: 'search', placeholder: 'Title, state, method or name'});
  private readonly notice = h('p', {class: 'note', role: 'status'});
  private readonly trouble = h('p', {class: 'error', role: 'alert', hidden: true});
  private readonly body = h('tbody');
  private readonly more = h('button', {type: 'button', hidden: true}, 'Show more');
  private readonly rows = new Map<string, Row>();
  private pages = 1;
  private listed: SolveJob[] = [];

  constructor() {
    this.search.addEventListener('input', () => this.draw());
    this.more.addEventListener('click', () => {
      ++this.pages;
      void this.poll();
    });
    const head = ['Title', 'State', 'Progress', 'Created', ''].map((title) => h('th', {scope: 'col'}, title));
    this.element = h(
      'div',
      {},
      h(
        'div',
        {class: 'line'},
        h('h1', {}, 'Solves'),
        h('a', {class: 'button main', href: '#/submit'}, 'Submit a problem'),
      ),
      h('p', {class: 'field'}, h('label', {for: 'search'}, 'Search'), this.search),
      this.trouble,
      this.notice,
      h('table', {class: 'jobs'}, h('thead', {}, h('tr', {}, head)), this.body),
      this.more,
    );
    void this.start();
  }

  destroy(): void {
    this.ended.abort();
  }

  private async start(): Promise<void> {
    try {
      const {jobs: limits} = await getCapabilities();
      if (limits === undefined) {
        replace(
          this.element,
          h('h1', {}, 'Solves'),
          h(
            'p',
            {class: 'card'},
            'This server keeps no solves: it was started without --store. ',
            h('a', {href: '#/submit'}, 'You can still solve a problem'),
            ' and watch it here.',
          ),
        );
        return;
      }
    } catch (error) {
      this.showTrouble(errorText(error));
    }
    pollWhileVisible(pollEvery, this.ended.signal, () => this.poll());
  }

  private async poll(): Promise<void> {
    try {
      const listed: SolveJob[] = [];
      let page: ListSolveJobsResponse | null = null;
      for (let i = 0; i < this.pages && (page === null || page.nextPageToken !== ''); ++i) {
        page = await jobs.listSolveJobs(
          {pageSize, pageToken: page?.nextPageToken ?? ''},
          {...shortCall(), signal: this.ended.signal},
        );
        listed.push(...page.jobs);
      }
      this.listed = listed;
      show(this.more, page !== null && page.nextPageToken !== '');
      this.showTrouble(null);
      this.draw();
    } catch (error) {
      if (!this.ended.signal.aborted) this.showTrouble(errorText(error));
    }
  }

  private showTrouble(trouble: string | null): void {
    setText(this.trouble, trouble ?? '');
    show(this.trouble, trouble !== null);
  }

  private draw(): void {
    const wanted = this.search.value.trim().toLowerCase();
    const shown = this.listed.filter((job) => textOf(job).includes(wanted));
    setText(
      this.notice,
      this.listed.length === 0
        ? 'There are no solves yet.'
        : shown.length === this.listed.length
          ? count(shown.length, 'solve')
          : `${shown.length} of ${count(this.listed.length, 'solve')}`,
    );
    const names = new Set(shown.map((job) => job.name));
    for (const [name, row] of this.rows) {
      if (names.has(name)) continue;
      row.element.remove();
      this.rows.delete(name);
    }
    let before: Element | null = null;
    for (const job of shown) {
      let row = this.rows.get(job.name);
      if (row === undefined) {
        row = new Row(
          job.name,
          () => this.poll(),
          (text) => this.showTrouble(text),
        );
        this.rows.set(job.name, row);
      }
      row.update(job);
      const place: Element | null = before === null ? this.body.firstElementChild : before.nextElementSibling;
      if (place !== row.element) this.body.insertBefore(row.element, place);
      before = row.element;
    }
  }
}

function textOf(job: SolveJob): string {
  const kind = job.ensemble === undefined ? 'solve' : 'ensemble';
  const words = [statusOf(job).text, methodWord(job.options?.method ?? 0), job.name, job.owner, job.requestId];
  return [titleOf(job), kind, ...words].join(' ').toLowerCase();
}

class Row {
  readonly element: HTMLTableRowElement;
  private readonly title: HTMLAnchorElement;
  private readonly about = h('span', {class: 'note'});
  private readonly state = h('span', {class: 'state'});
  private readonly bar = h('progress', {max: 1, 'aria-label': 'Progress'});
  private readonly left = h('span', {class: 'note'});
  private readonly created = h('span');
  private readonly act = h('button', {type: 'button'});
  private job: SolveJob | null = null;
  private sure = false;

  constructor(
    name: string,
    private readonly renew: () => Promise<void>,
    private readonly showTrouble: (text: string) => void,
  ) {
    this.title = h('a', {href: `#/${name}`});
    this.act.addEventListener('click', () => void this.onAct());
    this.act.addEventListener('blur', () => {
      this.sure = false;
      this.drawAct();
    });
    this.element = h(
      'tr',
      {},
      h('td', {}, this.title, this.about),
      h('td', {}, this.state),
      h('td', {}, this.bar, this.left),
      h('td', {}, this.created),
      h('td', {}, this.act),
    );
  }

  update(job: SolveJob): void {
    this.job = job;
    const ended = hasEnded(job.state);
    setText(this.title, titleOf(job));
    const about = [
      job.ensemble === undefined ? '' : `Ensemble: ${membersText(job.ensemble)}`,
      job.states > 0 ? `${count(job.states, 'state')}, ${count(job.constraints, 'pair')}` : '',
      job.states > 0 ? job.owner : '',
    ];
    setText(this.about, about.filter((text) => text !== '').join(', '));
    const {text, look} = statusOf(job);
    setText(this.state, text);
    this.state.dataset.state = look;
    show(this.bar, !ended);
    this.bar.value = job.progress;
    const from = job.startTime ?? job.createTime;
    const elapsed =
      from === undefined
        ? 0
        : ((job.endTime === undefined ? Date.now() : milliseconds(job.endTime)) - milliseconds(from)) / 1000;
    setText(
      this.left,
      ended
        ? `took ${duration(Math.max(0, elapsed))}`
        : `${Math.floor(100 * job.progress)} % ${timeLeft(elapsed, job.progress)}`,
    );
    setText(this.created, ago(job.createTime));
    this.drawAct();
  }

  private drawAct(): void {
    if (this.job === null) return;
    const does = hasEnded(this.job.state) ? (this.sure ? 'Delete for good?' : 'Delete') : 'Cancel';
    setText(this.act, does);
    this.act.setAttribute('aria-label', `${does} ${titleOf(this.job)}`);
    show(this.act, hasEnded(this.job.state) || canCancel(this.job.state));
  }

  private async onAct(): Promise<void> {
    if (this.job === null) return;
    const {name, state} = this.job;
    const deletes = hasEnded(state);
    if (deletes && !this.sure) {
      this.sure = true;
      this.drawAct();
      return;
    }
    this.act.disabled = true;
    try {
      await (deletes ? jobs.deleteSolveJob({name}, shortCall()) : jobs.cancelSolveJob({name}, shortCall()));
      await this.renew();
    } catch (error) {
      this.showTrouble(errorText(error));
    } finally {
      this.act.disabled = false;
    }
  }
}

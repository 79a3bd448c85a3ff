// SPDX-License-Identifier: Apache-2.0
// The page: one view at a time, chosen by what follows # in the address.

import 'uplot/dist/uPlot.min.css';
import './style.css';
import {h, replace} from './dom';
import {JobsView} from './views/jobs';
import {JobView} from './views/job';
import type {View} from './views/page';
import {StreamView} from './views/stream';
import {SubmitView} from './views/submit';

const main = h('main', {id: 'main', tabindex: -1});
const links = [
  ['#/jobs', 'Solves'],
  ['#/submit', 'Submit'],
].map(([href, text]) => h('a', {href}, text));
let view: View | null = null;

function viewOf(route: string): View {
  if (/^#\/jobs\/[\w-]+$/.test(route)) return new JobView(route.slice(2));
  if (route === '#/submit') return new SubmitView();
  if (route === '#/solve') return new StreamView();
  return new JobsView();
}

function go(): void {
  view?.destroy();
  view = viewOf(location.hash);
  document.title = `${view.title} – dlcs`;
  for (const link of links) {
    if (link.hash === (location.hash || '#/jobs')) {
      link.setAttribute('aria-current', 'page');
    } else {
      link.removeAttribute('aria-current');
    }
  }
  replace(main, view.element);
}

const skip = h('a', {class: 'skip', href: '#main'}, 'Skip to the content');
skip.addEventListener('click', (event) => {
  // #main would be taken for a view.
  event.preventDefault();
  main.focus();
});
replace(
  document.body,
  skip,
  h('nav', {'aria-label': 'Main'}, h('a', {class: 'brand', href: '#/jobs'}, 'dlcs'), links),
  main,
);
addEventListener('hashchange', () => {
  go();
  scrollTo(0, 0);
});
go();

// SPDX-License-Identifier: Apache-2.0
// What the server knows about a problem without solving it, in the order and the words of `dlcs analyze`.

import {
  Answer,
  type AnalysisSection,
  type AnalyzeProblemResponse,
  type Constant,
  ConstantKind,
  type Finding,
} from '../../generated/dlcs/v1/solver_pb';
import {h} from '../dom';
import {count, general} from '../format';
import {methodWord} from '../names';
import {facts, section} from './solve/panel';

const answers: {[answer in Answer]?: string} = {[Answer.YES]: 'yes', [Answer.NO]: 'no', [Answer.UNKNOWN]: 'unknown'};

const relations: {[kind in ConstantKind]?: string} = {
  [ConstantKind.UPPER_BOUND]: '≤',
  [ConstantKind.LOWER_BOUND]: '≥',
  [ConstantKind.ESTIMATE]: '≈',
};

export function analysisCard(analysis: AnalyzeProblemResponse): HTMLElement {
  const {states, constraints, horizon, matrixClass, rule, recommendation, warnings, sections} = analysis;
  const options = recommendation?.options;
  const advice =
    options === undefined
      ? ''
      : [
          methodWord(options.method),
          options.errorTolerance > 0 && `tolerance ${general(options.errorTolerance)}`,
          options.grid.case === 'steps' && count(options.grid.value, 'step'),
          options.grid.case === 'step' && `steps of ${general(options.grid.value)}`,
        ]
          .filter((text) => text !== false)
          .join(', ');
  return section(
    'Analysis',
    facts([
      ['Size', `${count(states, 'state')}, ${count(constraints, 'pair')}, T = ${general(horizon)}`],
      ['Class of M', matrixClass],
      ['Solution', rule],
      recommendation?.refusal ? ['No method', recommendation.refusal] : ['Advice', advice],
      ['Why', recommendation?.reasons.join(' ') ?? ''],
    ]),
    warnings.length > 0 &&
      h(
        'ul',
        {class: 'warnings'},
        warnings.map((text) => h('li', {}, `Warning: ${text}`)),
      ),
    sections.map(sectionPart),
  );
}

function sectionPart({title, findings, constants, warnings}: AnalysisSection): HTMLElement {
  return h(
    'details',
    {},
    h('summary', {}, title),
    facts([...findings.map(findingRow), ...constants.map(constantRow)]),
    warnings.map((text) => h('p', {}, `Warning: ${text}`)),
  );
}

function findingRow({title, answer, reason, source}: Finding): [string, string] {
  const grounds = [reason, source === '' ? '' : `[${source}]`].filter((text) => text !== '').join(' ');
  return [title, `${answers[answer] ?? 'unknown'}${grounds === '' ? '' : `: ${grounds}`}`];
}

function constantRow({symbol, title, value, kind, reason, source}: Constant): [string, string] {
  const number = value === undefined ? 'not known' : `${relations[kind] ?? '='} ${general(value)}`;
  const grounds = [reason, source === '' ? '' : `[${source}]`].filter((text) => text !== '').join(' ');
  return [symbol === '' ? title : `${title}, ${symbol}`, `${number}${grounds === '' ? '' : `; ${grounds}`}`];
}

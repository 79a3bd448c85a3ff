// SPDX-License-Identifier: Apache-2.0
// How well the trajectory satisfies the system, how its error was estimated, what the solve cost and when pairs switch.

import {
  type Accuracy,
  type Certificate,
  type Cost,
  type Multiplier,
  type PeriodicSolution,
  Stability,
  type Summary,
} from '../../../generated/dlcs/v1/solver_pb';
import {h, replace, show, table} from '../../dom';
import {bytes, count, duration, general, size} from '../../format';
import {type Names, propagatorWord, switchingWord} from '../../names';
import type {SolveData} from '../../solve/data';
import {facts, type Panel, section} from './panel';

const mostRows = 200;
const mostMultipliers = 10;
const mostMeans = 50;

export class CertificatePanel implements Panel {
  readonly element = h('div', {class: 'columns'});
  private drawn: unknown = null;

  update({model: {summary, names}}: SolveData): void {
    show(this.element, summary !== null);
    if (summary === null || summary === this.drawn) return;
    this.drawn = summary;
    const {certificate, accuracy, cost} = summary;
    const measured = summary.times > 0 && certificate !== undefined && !Number.isNaN(certificate.nodeResidual);
    replace(
      this.element,
      (summary.periodic?.period ?? 0) > 0 && periodicPart(summary.periodic!, names),
      measured && certificatePart(certificate, accuracy),
      cost !== undefined && costPart(cost, summary),
      summary.switchingTimes.length > 0 && switchingPart(summary, names),
      summary.jumps.length > 0 && jumpsPart(summary),
    );
  }
}

// The period, what becomes of disturbances, and averages.
function periodicPart(periodic: PeriodicSolution, names: Names): HTMLElement {
  const {period, phase, periods, newtonIterations, residual, error, multipliers} = periodic;
  const more = multipliers.length - mostMultipliers;
  const means: [string, number[], (i: number) => string][] =
    periodic.meanOutputs.length > 0
      ? [['Averages', periodic.meanOutputs, (i) => names.z(i)]]
      : [
          ['Averages of x', periodic.meanX, (i) => names.x(i)],
          ['Averages of y', periodic.meanY, (i) => names.y(i)],
          ['Averages of w', periodic.meanW, (i) => names.w(i)],
        ];
  return section(
    'Periodic solution',
    facts([
      ['Period', `${general(period, 12)}${phase > 0 ? `, from t = ${general(phase)} on` : ''}`],
      ['Found in', `${count(periods, 'period')} integrated, ${count(newtonIterations, 'step')} of Newton's method`],
      ['x(period) - x(0)', residual === undefined ? '' : `${size(residual)} of the size of a state`],
      ['Error of x(0)', error === undefined ? '' : size(error)],
      ['Stability', stabilityText(periodic)],
      [
        'Multipliers',
        multipliers.slice(0, mostMultipliers).map(multiplierText).join(', ') +
          (more > 0 ? `, and ${more} smaller ones` : ''),
      ],
      ...means.map(([title, values, name]): [string, string] => [
        title,
        values
          .slice(0, mostMeans)
          .map((value, i) => `${name(i)} ${general(value)}`)
          .join(', ') + (values.length > mostMeans ? ', … in the JSON' : ''),
      ]),
    ]),
  );
}

// "stable: disturbances shrink by 2.1 % a period".
function stabilityText({stability, growth = 0, multipliers}: PeriodicSolution): string {
  const factor = 1 + growth;
  switch (stability) {
    case Stability.STABLE:
      if (factor === 0) return 'stable: disturbances die out within a period';
      return factor < 0.5
        ? `stable: disturbances shrink to ${general(factor, 2)} of their size in a period`
        : `stable: disturbances shrink by ${general(-100 * growth, 2)} % a period`;
    case Stability.UNSTABLE:
      return factor > 2
        ? `unstable: disturbances grow by a factor of ${general(factor, 2)} a period`
        : `unstable: disturbances grow by ${general(100 * growth, 2)} % a period`;
    case Stability.UNDETERMINED:
      return multipliers.length === 0
        ? 'not known, since the multipliers are not'
        : 'not known: the multipliers, with their errors, do not tell';
    default:
      return '';
  }
}

function multiplierText({real, imaginary}: Multiplier): string {
  if (imaginary === 0) return general(real);
  const sign = imaginary < 0 ? '-' : '+';
  return `${general(real)} ${sign} ${general(Math.abs(imaginary))}i (size ${general(Math.hypot(real, imaginary))})`;
}

function certificatePart(c: Certificate, accuracy: Accuracy | undefined): HTMLElement {
  // Where x solves the equation exactly for the computed y, the defect says nothing about the error of y.
  const exact = c.odeDefect <= 1e-14 * c.odeScale;
  return section(
    'Certificate',
    h('p', {class: 'note'}, 'Measured from x and y after the solve. Compare each value with the size beside it.'),
    table(
      ['', 'at nodes', 'between them', 'size'],
      [
        ['LCP residual, min(y, w)', size(c.nodeResidual), size(c.midpointResidual), `${general(c.lcpScale, 2)} (y, w)`],
        ['complementarity, y w', size(c.nodeComplementarity), size(c.midpointComplementarity), ''],
        ["defect of x'", '', size(c.odeDefect), `${general(c.odeScale, 2)} (x')`],
      ],
      {label: 'Certificate'},
    ),
    exact && h('p', {class: 'note'}, 'The defect is measured for the computed y: it does not show the error of y.'),
    facts([
      ['Estimated error', errorText(accuracy)],
      ['', accuracy?.note ?? ''],
    ]),
  );
}

function errorText(accuracy: Accuracy | undefined): string {
  if (accuracy?.error === undefined) return 'none';
  const largest = (errors: number[], of: string) =>
    errors.length === 0 ? [] : [`${size(errors.reduce((a, b) => Math.max(a, b)))} of ${of}`];
  const parts = [
    ...largest(accuracy.errorsX, 'x'),
    ...largest(accuracy.errorsBy, 'B y'),
    ...largest(accuracy.errorsW, 'w'),
  ];
  return `${size(accuracy.error)} of the size of each component${parts.length > 0 ? `: ${parts.join(', ')}` : ''}`;
}

function costPart(cost: Cost, {propagator}: Summary): HTMLElement {
  const counts = [
    count(cost.steps, 'step'),
    cost.windows > 0 && count(cost.windows, 'window'),
    cost.iterations > 0 && count(cost.iterations, 'iteration'),
    count(cost.lcps, 'LCP'),
    cost.coupledSteps > 0 && `${count(cost.coupledSteps, 'coupled step')}`,
  ].filter((text) => text !== false);
  const parts: [string, number][] = [
    ['set-up', cost.secondsSetup],
    ['LCPs', cost.secondsLcp],
    ['linear algebra', cost.secondsLinear],
    ['certificate', cost.secondsCertificate],
  ];
  const listed = parts.reduce((sum, [, seconds]) => sum + seconds, 0);
  parts.push(['the rest', Math.max(0, cost.secondsTotal - listed)]);
  const whole = Math.max(cost.secondsTotal, listed);
  return section(
    'Time',
    facts([
      ['In all', duration(cost.secondsTotal)],
      ['Work', cost.lcps > 0n ? counts.join(', ') : ''],
    ]),
    h(
      'dl',
      {class: 'shares'},
      parts
        .filter(([, seconds]) => seconds > 0)
        .map(([name, seconds]) =>
          h(
            'div',
            {},
            h('dt', {}, name),
            h(
              'dd',
              {},
              h('meter', {min: 0, max: whole || 1, value: seconds, 'aria-label': name}),
              ` ${general(seconds, 2)} s`,
            ),
          ),
        ),
    ),
    facts([
      ['Memory', cost.processPeakBytes > 1e8 ? `${bytes(cost.processPeakBytes)} at most in the process, so far` : ''],
      [
        'Propagator',
        propagator !== undefined && propagator.used > 1
          ? `${propagatorWord(propagator.used)}${propagator.reason === '' ? '' : `: ${propagator.reason}`}`
          : '',
      ],
    ]),
  );
}

function switchingPart({switchingTimes, switchings}: Summary, names: Names): HTMLElement {
  const listed = (pairs: number[]) => (pairs.length === 0 ? '–' : pairs.map((i) => names.y(i)).join(', '));
  return section(
    'Switching times',
    table(
      ['t', '', 'becomes active', 'becomes inactive'],
      switchingTimes
        .slice(0, mostRows)
        .map((switching) => [
          general(switching.time, 10),
          switchingWord(switching.kind),
          listed(switching.entering),
          listed(switching.leaving),
        ]),
      {label: 'Switching times'},
    ),
    switchings > mostRows && h('p', {}, `And ${switchings - mostRows} more; the JSON has them.`),
  );
}

function jumpsPart({jumps}: Summary): HTMLElement {
  const list = (values: number[]) =>
    values
      .slice(0, 8)
      .map((value) => general(value))
      .join(', ') + (values.length > 8 ? `, … (${values.length} in all)` : '');
  return section(
    'State jumps',
    table(
      ['t', 'dx', 'multiplier'],
      jumps.slice(0, mostRows).map((jump) => [general(jump.time, 10), list(jump.dx), list(jump.multiplier)]),
      {label: 'State jumps'},
    ),
  );
}

// SPDX-License-Identifier: Apache-2.0
// From the fields of a request, which the server names in its errors, to the places where a person entered them.

import type {Path} from './json';

const keys: {[field: string]: string} = {
  a: 'A',
  b: 'B',
  n: 'N',
  m: 'M',
  w: 'W',
  e: 'E',
  horizon: 'T',
  state_names: 'states',
  pair_names: 'pairs',
};

/** Names of the inputs beside the editor. */
export type Option = 'method' | 'tolerance' | 'absolute' | 'steps' | 'points' | 'title';

const options: {[field: string]: Option} = {
  'options.method': 'method',
  'options.error_tolerance': 'tolerance',
  'options.absolute_tolerance': 'absolute',
  'options.absolute_tolerances': 'absolute',
  'options.steps': 'steps',
  'options.step': 'steps',
  'options.output_times': 'points',
  options: 'method',
  title: 'title',
};

export function placeOf(field: string): {option: Option} | {path: Path} | null {
  // The name of the component may follow the path in parentheses: problem.x0[0] (vC).
  const steps = [...field.split(' ')[0].matchAll(/[A-Za-z_]\w*|\d+/g)].map(([step]) => step);
  if (steps[0] === 'solve') steps.shift();
  const name = steps.join('.');
  const option = options[name] ?? options[steps.slice(0, 2).join('.')];
  if (option !== undefined) return {option};
  if (steps[0] !== 'problem' && steps[0] !== 'nonlinear') return null;
  const path: Path = steps.slice(1).map((step) => (/^\d+$/.test(step) ? Number(step) : step));
  if (typeof path[0] === 'string') path[0] = keys[path[0]] ?? path[0];
  if (path[0] === 'outputs' && (path[1] === 'c' || path[1] === 'd')) path[1] = path[1].toUpperCase();
  // In the file, a single piece of formulas or numbers has none of the keys around it.
  const pieces = path.indexOf('pieces');
  if (pieces > 0 && path[pieces + 2] !== undefined) path.splice(pieces, 3);
  return {path};
}

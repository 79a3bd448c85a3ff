// SPDX-License-Identifier: Apache-2.0
// A problem file as the message of the contract, and everything that is wrong with it.

import {create} from '@bufbuild/protobuf';
import nonlinearSchema from '../../../nonlinear.schema.json';
import problemSchema from '../../../problem.schema.json';
import {
  type NonlinearProblem,
  NonlinearProblemSchema,
  type Parameter,
  ParameterSchema,
  type Problem,
  ProblemSchema,
  SelectorSchema,
  SolutionRule,
} from '../../generated/dlcs/v1/solver_pb';
import {isObject, type Json, type JsonObject, parseJson, type Path} from './json';
import {readMatrix, readVector, shapeOf} from './matrix';
import {readMeasurements, readOutputs} from './outputs';
import {Reader} from './reader';
import {type FieldError, Schemas} from './schema';
import {readFormulas, readSources} from './source';

export interface ProblemFile {
  name: string;
  system: {case: 'problem'; value: Problem} | {case: 'nonlinear'; value: NonlinearProblem};
  horizon: number;
  states: number;
  pairs: number;
  /** Sizes of the factors where A is a Kronecker sum: the states are the points of that grid. */
  grid: number[];
}

const schemas = new Schemas({
  'problem.schema.json': problemSchema as unknown as JsonObject,
  'nonlinear.schema.json': nonlinearSchema as unknown as JsonObject,
});

const rules: {[word: string]: SolutionRule} = {
  auto: SolutionRule.UNSPECIFIED,
  unique: SolutionRule.UNIQUE,
  'least-element': SolutionRule.LEAST_ELEMENT,
  'hidden-least-element': SolutionRule.HIDDEN_LEAST_ELEMENT,
  'least-norm': SolutionRule.LEAST_NORM,
  minimizer: SolutionRule.MINIMIZER,
  sparsest: SolutionRule.SPARSEST,
  history: SolutionRule.HISTORY,
};

/** Throws a JsonError if `text` is not JSON. There is a file if and only if there are no errors. */
export function readProblem(text: string): {file: ProblemFile | null; errors: FieldError[]} {
  const root = parseJson(text);
  if (!isObject(root)) return {file: null, errors: [{path: [], rule: 'The text must be one object {...}'}]};
  const other = otherKind(root);
  if (other !== null) return {file: null, errors: [{path: [], rule: other}]};
  const nonlinear = root.kind === 'nonlinear';
  const reader = new Reader();
  const file = nonlinear ? readNonlinear(root, reader) : readLinear(root, reader);
  // The reader knows more (shapes), so its errors come first. The schema checks the rest.
  const bySchema = schemas.check(root, nonlinear ? 'nonlinear.schema.json' : 'problem.schema.json');
  const errors = [...reader.errors, ...bySchema.filter((error) => !reader.errors.some((own) => overlap(own, error)))];
  return {file: errors.length === 0 ? file : null, errors};
}

function overlap(one: FieldError, other: FieldError): boolean {
  const length = Math.min(one.path.length, other.path.length);
  if (length === 0) return one.path.length === other.path.length && one.rule.split(';')[0] === other.rule.split(';')[0];
  return one.path.slice(0, length).every((step, i) => step === other.path[i]);
}

// What other files of these programs hold.
function otherKind(root: JsonObject): string | null {
  const has = (key: string) => key in root;
  if (has('members') && !has('A')) return 'This holds the members of an ensemble; run dlcs ensemble with it';
  if (has('kind') || (has('N') && has('x0'))) return null;
  if (has('C') && has('d')) return 'This is an input-output model; make a problem of it with dlcs model input-output';
  if (has('M') && has('q') && isObject(root.q)) {
    return 'This is a dynamic complementarity problem; run dlcs dcp with it';
  }
  if (has('M') && has('q')) return 'This is one linear complementarity problem; run dlcs lcp with it';
  return null;
}

function readLinear(root: JsonObject, reader: Reader): ProblemFile {
  const problem = create(ProblemSchema, readShared(root, reader));
  const matrixAt = (key: string, rule: string) => {
    const value = reader.require(root, key, [], rule);
    return value === undefined ? undefined : (readMatrix(value, [key], reader, /*mayHaveFormulas=*/ true) ?? undefined);
  };
  problem.a = matrixAt('A', 'it must hold the m rows of the state matrix, as in [[-1, 0], [0, -2]]');
  problem.b = matrixAt('B', 'it must hold m rows with a value per complementarity pair');
  problem.n = matrixAt('N', 'it must hold a row per complementarity pair with m values');
  problem.m = matrixAt('M', 'it must hold the n rows of the complementarity matrix');
  if ('E' in root) problem.e = readMatrix(root.E, ['E'], reader, /*mayHaveFormulas=*/ true) ?? undefined;
  const states = shapeOf(problem.a).rows;
  const pairs = shapeOf(problem.m).rows;
  const {f, g} = readSources(root, states, pairs, reader);
  problem.f = f;
  problem.g = g;
  problem.rule =
    typeof root.rule === 'string' ? (rules[root.rule] ?? SolutionRule.UNSPECIFIED) : SolutionRule.UNSPECIFIED;
  if ('y0' in root) problem.y0 = readVector(root.y0, ['y0'], reader) ?? [];
  if (isObject(root.selector)) {
    const {C, b} = root.selector;
    const c = C === undefined ? null : readMatrix(C, ['selector', 'C'], reader);
    const values = b === undefined ? null : reader.numbers(b, ['selector', 'b']);
    if (c !== null && values !== null) problem.selector = create(SelectorSchema, {c, b: values});
  }
  problem.outputs = readOutputs(root, reader);
  problem.measurements = readMeasurements(root, reader);
  const factors = problem.a?.kind.case === 'kroneckerSum' ? problem.a.kind.value.factors : [];
  const grid = factors.map((factor) => shapeOf(factor).rows);
  return {name: nameOf(root), system: {case: 'problem', value: problem}, horizon: problem.horizon, states, pairs, grid};
}

function readNonlinear(root: JsonObject, reader: Reader): ProblemFile {
  const problem = create(NonlinearProblemSchema, readShared(root, reader));
  const formulasAt = (key: string) => {
    const list = reader.require(root, key, [], 'it must hold a list of formulas in t, x1, x2, ... and y1, y2, ...');
    return Array.isArray(list) ? readFormulas(list, [key], reader) : [];
  };
  problem.f = formulasAt('f');
  problem.g = formulasAt('g');
  if ('W' in root) problem.w = readMatrix(root.W, ['W'], reader, /*mayHaveFormulas=*/ true) ?? undefined;
  return {
    name: nameOf(root),
    system: {case: 'nonlinear', value: problem},
    horizon: problem.horizon,
    states: problem.f.length,
    pairs: problem.g.length,
    grid: [],
  };
}

function nameOf(root: JsonObject): string {
  return typeof root.name === 'string' ? root.name : '';
}

// What both kinds of problems have.
function readShared(root: JsonObject, reader: Reader) {
  const x0 = reader.require(root, 'x0', [], 'it must hold the m values of the initial state');
  const end = reader.require(root, 'T', [], 'it must hold the end time, a number above 0');
  return {
    x0: x0 === undefined ? [] : (readVector(x0, ['x0'], reader) ?? []),
    horizon: end === undefined ? 0 : (reader.number(end, ['T']) ?? 0),
    breakPoints: 'break_points' in root ? (readVector(root.break_points, ['break_points'], reader) ?? []) : [],
    stateNames: readTexts(root.states, ['states'], reader),
    pairNames: readTexts(root.pairs, ['pairs'], reader),
    parameters: readParameters(root.parameters, reader),
  };
}

function readTexts(value: Json | undefined, path: Path, reader: Reader): string[] {
  return Array.isArray(value) ? value.map((entry, i) => reader.text(entry, [...path, i]) ?? '') : [];
}

function readParameters(value: Json | undefined, reader: Reader): Parameter[] {
  if (!isObject(value)) return [];
  // In the order of the command line, so that both send the same bytes.
  return Object.keys(value)
    .sort()
    .map((name) => create(ParameterSchema, {name, value: reader.number(value[name], ['parameters', name]) ?? 0}));
}

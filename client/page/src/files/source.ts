// SPDX-License-Identifier: Apache-2.0
// f and g of a problem file: formulas, samples, polynomials; in pieces; a matrix times few functions.

import {create} from '@bufbuild/protobuf';
import {
  PiecewisePolynomial_CoefficientsSchema,
  type DenseMatrix,
  type TimeFunction,
  TimeFunctionSchema,
  type TimePiece,
  TimePieceSchema,
} from '../../generated/dlcs/v1/solver_pb';
import {describe, isObject, type Json, type JsonObject, type Path} from './json';
import {readMatrix, shapeOf} from './matrix';
import type {Reader} from './reader';

type Kind = TimePiece['kind'];
const nothing: Kind = {case: undefined};
// Limit of the zeros that stand for a missing f or g, since a few bytes may declare any number of components.
const mostZeros = 2 ** 23;

/** f (with one component for each state) and g (for each pair). */
export function readSources(
  root: JsonObject,
  states: number,
  pairs: number,
  reader: Reader,
): {f: TimeFunction; g: TimeFunction} {
  if (!('pieces' in root))
    return {f: readFunction(root, 'f', [], states, reader), g: readFunction(root, 'g', [], pairs, reader)};
  const f = create(TimeFunctionSchema);
  const g = create(TimeFunctionSchema);
  for (const key of ['f', 'g']) {
    if (key in root) reader.refuse([key], 'is given as well as pieces, which hold f and g; keep one of them');
  }
  eachPiece(root.pieces, ['pieces'], '{"t0": ..., "f": ..., "g": ...}', reader, (piece, start, path) => {
    f.pieces.push(create(TimePieceSchema, {start, kind: readOrZero(piece, 'f', path, states, reader)}));
    g.pieces.push(create(TimePieceSchema, {start, kind: readOrZero(piece, 'g', path, pairs, reader)}));
  });
  return {f, g};
}

/** The function under a key of the object at `at`. */
export function readFunction(root: JsonObject, key: string, at: Path, size: number, reader: Reader): TimeFunction {
  const made = create(TimeFunctionSchema);
  const value = root[key];
  const path = [...at, key];
  if (!isObject(value) || !('matrix' in value || 'pieces' in value)) {
    made.pieces.push(create(TimePieceSchema, {kind: readOrZero(root, key, at, size, reader)}));
    return made;
  }
  let components = size;
  if ('matrix' in value) {
    made.lift = readMatrix(value.matrix, [...path, 'matrix'], reader) ?? undefined;
    components = shapeOf(made.lift).columns;
  }
  if ('pieces' in value) {
    eachPiece(value.pieces, [...path, 'pieces'], '{"t0": ..., "of": ...}', reader, (piece, start, place) => {
      const of = reader.require(piece, 'of', place, 'it must hold the function from there on');
      if (of === undefined) return;
      made.pieces.push(create(TimePieceSchema, {start, kind: readSource(of, [...place, 'of'], components, reader)}));
    });
  } else {
    const of = reader.require(value, 'of', path, 'it must hold the functions that the matrix multiplies');
    if (of !== undefined)
      made.pieces.push(create(TimePieceSchema, {kind: readSource(of, [...path, 'of'], components, reader)}));
  }
  return made;
}

function eachPiece(
  value: Json,
  path: Path,
  form: string,
  reader: Reader,
  read: (piece: JsonObject, start: number, path: Path) => void,
): void {
  if (!Array.isArray(value) || value.length === 0) {
    reader.refuse(path, `is ${describe(value)}; must be a list of objects ${form}`);
    return;
  }
  value.forEach((entry, k) => {
    const place = [...path, k];
    const piece = reader.object(entry, place, `an object ${form}`);
    if (piece === null) return;
    const t0 = reader.require(piece, 't0', place, 'it must hold the time from which the piece is valid');
    if (t0 !== undefined) read(piece, reader.number(t0, [...place, 't0']) ?? 0, place);
  });
}

function readOrZero(object: JsonObject, key: string, path: Path, size: number, reader: Reader): Kind {
  const place = [...path, key];
  if (key in object) return readSource(object[key], place, size, reader);
  if (size > mostZeros) {
    reader.refuse(path, `has no "${key}", and zero in ${size} components makes more than ${mostZeros} numbers`);
    return nothing;
  }
  return {case: 'constant', value: {$typeName: 'dlcs.v1.ConstantFunction', values: new Array<number>(size).fill(0)}};
}

function readSource(value: Json, path: Path, size: number, reader: Reader): Kind {
  if (Array.isArray(value)) return readComponents(value, path, reader);
  if (!isObject(value)) {
    reader.refuse(
      path,
      `is ${describe(value)}; must be a list with a formula or a number per component, as in ` +
        '["sin(t)", 0], or an object with samples or polynomials',
    );
    return nothing;
  }
  return 'breaks' in value || 'coefficients' in value
    ? readPolynomials(value, path, size, reader)
    : readSamples(value, path, size, reader);
}

// Numbers alone are a constant; next to formulas they are written as formulas, with all their digits.
function readComponents(list: Json[], path: Path, reader: Reader): Kind {
  if (list.every((entry) => typeof entry === 'number')) {
    return {case: 'constant', value: {$typeName: 'dlcs.v1.ConstantFunction', values: list as number[]}};
  }
  return {case: 'formulas', value: {$typeName: 'dlcs.v1.FormulaFunction', formulas: readFormulas(list, path, reader)}};
}

export function readFormulas(list: Json[], path: Path, reader: Reader): string[] {
  return list.map((entry, i) => {
    if (typeof entry === 'number' || typeof entry === 'string') return String(entry);
    reader.refuse([...path, i], `is ${describe(entry)}; must be a formula (text) or a number`);
    return '0';
  });
}

// On the wire the rows are concatenated, so a row of the wrong length would shift the others.
function readRowsOf(size: number, value: Json, path: Path, reader: Reader): DenseMatrix | null {
  const rows = reader.rows(value, path);
  if (rows === null || rows.columns === size || size === 0) return rows;
  return reader.refuse(
    path,
    `has rows of ${rows.columns}; must have one value per component in each row, ${size} here`,
  );
}

function readSamples(object: JsonObject, path: Path, size: number, reader: Reader): Kind {
  const times = reader.require(object, 'times', path, 'samples need their times');
  const values = reader.require(object, 'values', path, 'samples need a row of values per time');
  if (times === undefined || values === undefined) return nothing;
  const list = reader.numbers(times, [...path, 'times']);
  const rows = readRowsOf(size, values, [...path, 'values'], reader);
  if (list === null || rows === null) return nothing;
  if (list.length !== rows.rows) {
    reader.refuse([...path, 'values'], `has ${rows.rows} rows for ${list.length} times; must have one row per time`);
    return nothing;
  }
  return {case: 'samples', value: {$typeName: 'dlcs.v1.SampledFunction', times: list, values: rows.values}};
}

function readPolynomials(object: JsonObject, path: Path, size: number, reader: Reader): Kind {
  const breaks = reader.require(object, 'breaks', path, 'polynomials need the ends of their intervals');
  const coefficients = reader.require(object, 'coefficients', path, 'polynomials need a list of rows per interval');
  if (breaks === undefined || coefficients === undefined) return nothing;
  const place = [...path, 'coefficients'];
  const list = reader.numbers(breaks, [...path, 'breaks']);
  if (!Array.isArray(coefficients)) {
    reader.refuse(place, `is ${describe(coefficients)}; must be a list with one polynomial per interval`);
    return nothing;
  }
  const made = coefficients.map((rows, p) =>
    create(PiecewisePolynomial_CoefficientsSchema, {
      values: readRowsOf(size, rows, [...place, p], reader)?.values ?? [],
    }),
  );
  return {
    case: 'polynomial',
    value: {$typeName: 'dlcs.v1.PiecewisePolynomial', breaks: list ?? [], coefficients: made},
  };
}

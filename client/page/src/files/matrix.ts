// SPDX-License-Identifier: Apache-2.0
// The forms of a matrix in a problem file: rows, sparse in three ways, a Kronecker sum.

import {create, type MessageInitShape} from '@bufbuild/protobuf';
import {
  type DenseMatrix,
  type Matrix,
  MatrixSchema,
  type SparseMatrix,
  SparseMatrixSchema,
} from '../../generated/dlcs/v1/solver_pb';
import {describe, isObject, type Json, type JsonObject, type Path} from './json';
import type {Reader} from './reader';

const mostRows = 2 ** 31 - 1;
// Limit for the entries of a matrix that a file describes by a rule. A browser has less memory than the command line.
const mostEntries = 2 ** 23;
const noFiles =
  'names a file, which this page cannot read from your disk. Write the matrix into the problem, ' +
  'or solve with: dlcs submit FILE';

export function readMatrix(value: Json, path: Path, reader: Reader, mayHaveFormulas = false): Matrix | null {
  if (Array.isArray(value)) return matrix('dense', reader.rows(value, path, mayHaveFormulas));
  if (isObject(value)) {
    if ('entries' in value) return matrix('sparse', readEntries(value, path, reader, mayHaveFormulas));
    if ('values' in value) return matrix('sparse', readValues(value, path, reader));
    if ('diagonals' in value) return matrix('sparse', readDiagonals(value, path, reader));
    if ('kronecker_sum' in value) return readSum(value, path, reader, mayHaveFormulas);
    if ('matrix_market' in value) return reader.refuse([...path, 'matrix_market'], noFiles);
  }
  const scalar = typeof value === 'number' ? `; a 1 x 1 matrix is written [[${value}]]` : '';
  return reader.refuse(
    path,
    `is ${describe(value)}; must be a list of rows, or an object with entries, values, ` +
      `diagonals or kronecker_sum${scalar}`,
  );
}

/** A list of numbers. Files of Matrix Market are refused, as for matrices. */
export function readVector(value: Json, path: Path, reader: Reader): number[] | null {
  if (isObject(value) && 'matrix_market' in value) return reader.refuse([...path, 'matrix_market'], noFiles);
  return reader.numbers(value, path);
}

export function shapeOf(matrix: Matrix | undefined): {rows: number; columns: number} {
  switch (matrix?.kind.case) {
    case 'dense':
    case 'sparse':
      return {rows: matrix.kind.value.rows, columns: matrix.kind.value.columns};
    case 'kroneckerSum': {
      const rows = matrix.kind.value.factors.reduce((product, factor) => product * shapeOf(factor).rows, 1);
      return {rows, columns: rows};
    }
    default:
      return {rows: 0, columns: 0};
  }
}

function matrix(form: 'dense' | 'sparse', value: DenseMatrix | SparseMatrix | null): Matrix | null {
  if (value === null) return null;
  const kind = {case: form, value} as MessageInitShape<typeof MatrixSchema>['kind'];
  return create(MatrixSchema, {kind});
}

function readShape(object: JsonObject, path: Path, reader: Reader, square = false): SparseMatrix | null {
  const readSize = (key: string) => {
    const value = reader.require(object, key, path, 'a sparse matrix needs its shape');
    return value === undefined ? null : reader.whole(value, [...path, key], 1, mostRows + 1);
  };
  const rows = readSize('rows');
  const columns = square && !('columns' in object) ? rows : readSize('columns');
  return rows === null || columns === null ? null : create(SparseMatrixSchema, {rows, columns});
}

function readEntries(object: JsonObject, path: Path, reader: Reader, mayHaveFormulas: boolean): SparseMatrix | null {
  const sparse = readShape(object, path, reader);
  const {entries} = object;
  const place = [...path, 'entries'];
  if (!Array.isArray(entries)) {
    return reader.refuse(place, `is ${describe(entries)}; must be a list of [row, column, value]`);
  }
  if (sparse === null) return null;
  const before = reader.errors.length;
  entries.forEach((entry, k) => {
    if (!Array.isArray(entry) || entry.length !== 3) {
      reader.refuse([...place, k], `is ${describe(entry)}; must be [row, column, value]`);
      return;
    }
    sparse.rowIndices.push(reader.whole(entry[0], [...place, k, 0], 0, sparse.rows) ?? 0);
    sparse.columnIndices.push(reader.whole(entry[1], [...place, k, 1], 0, sparse.columns) ?? 0);
    reader.entry(entry[2], [...place, k, 2], mayHaveFormulas, sparse);
  });
  return reader.errors.length === before ? sparse : null;
}

function readValues(object: JsonObject, path: Path, reader: Reader): SparseMatrix | null {
  const sparse = readShape(object, path, reader);
  const values = reader.numbers(object.values, [...path, 'values']);
  if (sparse === null || values === null) return null;
  const readIndices = (key: string, limit: number) => {
    const list = reader.require(object, key, path, 'a sparse matrix needs an index for each of its values');
    const numbers = list === undefined ? null : reader.numbers(list, [...path, key]);
    return numbers?.map((index, k) => reader.whole(index, [...path, key, k], 0, limit) ?? 0);
  };
  const before = reader.errors.length;
  const rows = readIndices('row_indices', sparse.rows);
  const columns = readIndices('column_indices', sparse.columns);
  if (reader.errors.length > before || !rows || !columns) return null;
  if (rows.length !== values.length || columns.length !== values.length) {
    return reader.refuse(
      path,
      `has ${rows.length} row_indices, ${columns.length} column_indices and ` +
        `${values.length} values; must have as many of each`,
    );
  }
  sparse.values = values;
  sparse.rowIndices = rows;
  sparse.columnIndices = columns;
  return sparse;
}

function readDiagonals(object: JsonObject, path: Path, reader: Reader): SparseMatrix | null {
  const sparse = readShape(object, path, reader, /*square=*/ true);
  const place = [...path, 'diagonals'];
  const diagonals = reader.object(object.diagonals, place, 'an object, as in {"0": 4, "1": -1}');
  if (sparse === null || diagonals === null) return null;
  const before = reader.errors.length;
  // In the order of the command line, so that both send the same bytes.
  for (const key of Object.keys(diagonals).sort()) {
    const value = diagonals[key];
    if (/^(0|-?[1-9]\d*)$/.test(key)) {
      readDiagonal(value, Number(key), [...place, key], reader, sparse);
    } else {
      const rule = 'is not a diagonal; "0" is the main one, "1" the one above it, "-1" the one below';
      reader.refuse([...place, key], rule);
    }
  }
  return reader.errors.length === before ? sparse : null;
}

function readDiagonal(value: Json, offset: number, path: Path, reader: Reader, sparse: SparseMatrix): void {
  const top = Math.max(0, -offset);
  const left = Math.max(0, offset);
  const length = Math.min(sparse.rows - top, sparse.columns - left);
  if (length < 1) {
    reader.refuse(path, `lies outside the ${sparse.rows} x ${sparse.columns} matrix`);
    return;
  }
  if (sparse.values.length + length > mostEntries) {
    reader.refuse(path, `makes more than ${mostEntries} entries`);
    return;
  }
  const values = typeof value === 'number' ? null : reader.numbers(value, path);
  if (typeof value !== 'number' && values === null) return;
  if (values !== null && values.length !== length) {
    reader.refuse(path, `has ${values.length} values; must have ${length}, or be one number`);
    return;
  }
  for (let k = 0; k < length; ++k) {
    sparse.rowIndices.push(top + k);
    sparse.columnIndices.push(left + k);
    sparse.values.push(values === null ? (value as number) : values[k]);
  }
}

function readSum(object: JsonObject, path: Path, reader: Reader, mayHaveFormulas: boolean): Matrix | null {
  const place = [...path, 'kronecker_sum'];
  const {kronecker_sum: list} = object;
  if (!Array.isArray(list) || list.length === 0) {
    return reader.refuse(place, `is ${describe(list)}; must be a list of square matrices`);
  }
  const before = reader.errors.length;
  const factors = list.map((factor, k) => {
    if (isObject(factor) && 'kronecker_sum' in factor) {
      return reader.refuse([...place, k], 'is a Kronecker sum; name all factors in one list');
    }
    return readMatrix(factor, [...place, k], reader, mayHaveFormulas);
  });
  if (reader.errors.length > before) return null;
  return create(MatrixSchema, {kind: {case: 'kroneckerSum', value: {factors: factors as Matrix[]}}});
}

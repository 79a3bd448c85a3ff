// SPDX-License-Identifier: Apache-2.0
// Reads parts of a problem file and collects what is wrong with them, each with its path.

import {create} from '@bufbuild/protobuf';
import {type DenseMatrix, DenseMatrixSchema, EntryFormulaSchema} from '../../generated/dlcs/v1/solver_pb';
import {describe, isObject, type Json, type JsonObject, type Path} from './json';
import type {FieldError} from './schema';

export class Reader {
  readonly errors: FieldError[] = [];

  refuse(path: Path, rule: string): null {
    this.errors.push({path, rule});
    return null;
  }

  require(object: JsonObject, key: string, path: Path, rule: string): Json | undefined {
    if (Object.hasOwn(object, key)) return object[key];
    this.refuse(path, `has no "${key}"; ${rule}`);
    return undefined;
  }

  number(value: Json, path: Path): number | null {
    if (typeof value === 'number') return value;
    const hint = looksLikeANumber(value) ? '; write it without quotes' : '';
    return this.refuse(path, `is ${describe(value)}; must be a number${hint}`);
  }

  whole(value: Json, path: Path, least: number, limit: number): number | null {
    if (typeof value === 'number' && Number.isInteger(value) && value >= least && value < limit) return value;
    return this.refuse(path, `is ${describe(value)}; must be a whole number from ${least} to ${limit - 1}`);
  }

  text(value: Json, path: Path): string | null {
    return typeof value === 'string'
      ? value
      : this.refuse(path, `is ${describe(value)}; must be text in double quotes`);
  }

  numbers(value: Json, path: Path): number[] | null {
    if (!Array.isArray(value)) return this.refuse(path, `is ${describe(value)}; must be a list of numbers`);
    const before = this.errors.length;
    value.forEach((entry, i) => typeof entry === 'number' || this.number(entry, [...path, i]));
    return this.errors.length === before ? (value as number[]) : null;
  }

  /** Rows of numbers or, if allowed, formulas of the parameters. */
  rows(value: Json, path: Path, mayHaveFormulas = false): DenseMatrix | null {
    if (!Array.isArray(value) || value.length === 0 || (Array.isArray(value[0]) && value[0].length === 0)) {
      return this.refuse(path, `is ${describe(value)}; must be a list of rows, each a list of at least one number`);
    }
    const before = this.errors.length;
    const columns = Array.isArray(value[0]) ? value[0].length : 0;
    const matrix = create(DenseMatrixSchema, {rows: value.length, columns});
    value.forEach((row, i) => {
      const place = [...path, i];
      if (!Array.isArray(row)) {
        const column = typeof row === 'number' ? '; a column is written [[1], [2]]' : '';
        this.refuse(place, `is ${describe(row)}; every row is a list${column}`);
      } else if (row.length !== columns) {
        this.refuse(
          place,
          `is of length ${row.length}, and the first row of ${columns}; all rows must be of one length`,
        );
      } else {
        row.forEach((entry, j) => this.entry(entry, [...place, j], mayHaveFormulas, matrix));
      }
    });
    return this.errors.length === before ? matrix : null;
  }

  /** Adds a number, or a formula of the parameters with 0 in its place. */
  entry(
    value: Json,
    path: Path,
    mayBeFormula: boolean,
    matrix: {values: number[]; formulas: DenseMatrix['formulas']},
  ): void {
    if (mayBeFormula && typeof value === 'string' && !looksLikeANumber(value)) {
      matrix.formulas.push(create(EntryFormulaSchema, {index: matrix.values.length, formula: value}));
      matrix.values.push(0);
    } else {
      matrix.values.push(this.number(value, path) ?? 0);
    }
  }

  object(value: Json, path: Path, rule: string): JsonObject | null {
    return isObject(value) ? value : this.refuse(path, `is ${describe(value)}; must be ${rule}`);
  }
}

function looksLikeANumber(value: Json): boolean {
  return typeof value === 'string' && value.trim() !== '' && Number.isFinite(Number(value));
}

// SPDX-License-Identifier: Apache-2.0
// The outputs and measurements of a problem file.

import {create} from '@bufbuild/protobuf';
import {
  CrossingDirection,
  type Measurement,
  type MeasurementInstant,
  MeasurementInstantSchema,
  MeasurementKind,
  MeasurementSchema,
  type Outputs,
  OutputsSchema,
} from '../../generated/dlcs/v1/solver_pb';
import {isObject, type Json, type JsonObject, type Path} from './json';
import {readMatrix} from './matrix';
import type {Reader} from './reader';
import {readFunction} from './source';

/** Nothing if there are none. */
export function readOutputs(root: JsonObject, reader: Reader): Outputs | undefined {
  if (!isObject(root.outputs)) return undefined;
  const value = root.outputs;
  const names = namesIn(root);
  const matrix = (key: string) =>
    key in value
      ? (readMatrix(value[key], ['outputs', key], reader, /*mayHaveFormulas=*/ true) ?? undefined)
      : undefined;
  const limits = isObject(value.limits) ? value.limits : {};
  return create(OutputsSchema, {
    names,
    c: matrix('C'),
    d: matrix('D'),
    h: 'h' in value ? readFunction(value, 'h', ['outputs'], names.length, reader) : undefined,
    hidden: typeof value.hidden === 'number' ? value.hidden : 0,
    // In the order of the command line, so that both send the same bytes.
    limits: Object.keys(limits)
      .sort()
      .map((name) => ({
        output: indexOf(name, names, ['outputs', 'limits', name], reader),
        value: reader.number(limits[name], ['outputs', 'limits', name]) ?? 0,
      })),
  });
}

export function readMeasurements(root: JsonObject, reader: Reader): Measurement[] {
  if (!Array.isArray(root.measurements)) return [];
  const names = namesIn(root);
  return root.measurements.filter(isObject).map((value, k) => {
    const path = ['measurements', k];
    const instant = (key: string) => {
      const at = value[key];
      return isObject(at) ? readInstant(at, names, [...path, key], reader) : undefined;
    };
    return create(MeasurementSchema, {
      name: textOf(value.name),
      kind: MeasurementKind[enumerator(value.kind) as keyof typeof MeasurementKind] ?? MeasurementKind.UNSPECIFIED,
      outputs: indices(value.outputs, names, [...path, 'outputs'], reader),
      begin: numberOf(value.begin) ?? 0,
      end: numberOf(value.end),
      at: instant('at'),
      until: instant('until'),
      formula: textOf(value.formula),
    });
  });
}

function readInstant(value: JsonObject, names: string[], path: Path, reader: Reader): MeasurementInstant {
  return create(MeasurementInstantSchema, {
    time: numberOf(value.time),
    outputs: indices(value.outputs, names, [...path, 'outputs'], reader),
    level: numberOf(value.level) ?? 0,
    direction:
      CrossingDirection[enumerator(value.direction) as keyof typeof CrossingDirection] ?? CrossingDirection.UNSPECIFIED,
    number: numberOf(value.number) ?? 0,
    after: numberOf(value.after) ?? 0,
  });
}

// The schema says what is wrong with values of another type.
function namesIn(root: JsonObject): string[] {
  const names = isObject(root.outputs) ? root.outputs.names : [];
  return Array.isArray(names) ? names.map(textOf) : [];
}

function textOf(value: Json | undefined): string {
  return typeof value === 'string' ? value : '';
}

function numberOf(value: Json | undefined): number | undefined {
  return typeof value === 'number' ? value : undefined;
}

/** "peak-to-peak" as PEAK_TO_PEAK. */
function enumerator(value: Json | undefined): string {
  return textOf(value).toUpperCase().replaceAll('-', '_');
}

function indices(value: Json | undefined, names: string[], path: Path, reader: Reader): number[] {
  if (!Array.isArray(value)) return [];
  return value.map((name, i) => indexOf(textOf(name), names, [...path, i], reader));
}

function indexOf(name: string, names: string[], path: Path, reader: Reader): number {
  const index = names.indexOf(name);
  if (index >= 0) return index;
  reader.refuse(path, `is "${name}"; must be the name of an output`);
  return 0;
}

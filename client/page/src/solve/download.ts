// SPDX-License-Identifier: Apache-2.0
// The files that a solve is saved as: the same JSON and CSV as the command line writes, and NPY for NumPy. They are put
// together from pieces, so that a large trajectory is never one string.

import {toJsonString} from '@bufbuild/protobuf';
import {
  type Analysis,
  AnalysisSchema,
  LeftLimitSchema,
  type Summary,
  SummarySchema,
  type TrajectoryChunk,
} from '../../generated/dlcs/v1/solver_pb';
import type {Names} from '../names';

export interface Solved {
  title: string;
  job: string;
  names: Names;
  analysis: Analysis | null;
  summary: Summary | null;
  states: number;
  pairs: number;
}

/** Builds a file from the chunks of a trajectory, in their order. */
export interface Writer {
  add(chunk: TrajectoryChunk): void;
  finish(): Blob;
}

export const writers: {[extension: string]: (solved: Solved) => Writer} = {
  json: (solved) => new JsonWriter(solved),
  csv: (solved) => new CsvWriter(solved),
  npy: (solved) => new NpyWriter(solved),
};

// Proto3 JSON: numbers that are not finite are strings.
function number(value: number): string {
  if (Object.is(value, -0)) return '-0.0';
  if (Number.isFinite(value)) return String(value);
  return Number.isNaN(value) ? '"NaN"' : value > 0 ? '"Infinity"' : '"-Infinity"';
}

/** A SolveResult of the contract. */
class JsonWriter implements Writer {
  private readonly parts: {[field: string]: string[]} = {times: [], x: [], y: [], w: [], left: []};
  /** For each output. */
  private readonly outputs: string[][];

  constructor(private readonly solved: Solved) {
    this.outputs = solved.names.outputs.map(() => []);
  }

  add(chunk: TrajectoryChunk): void {
    const put = (field: string, values: number[]) => {
      if (values.length > 0) this.parts[field].push(values.map(number).join(','));
    };
    put('times', chunk.times);
    put('x', chunk.x);
    put('y', chunk.y);
    put('w', chunk.w);
    const count = this.outputs.length;
    this.outputs.forEach((parts, i) =>
      parts.push(chunk.times.map((_, k) => number(chunk.outputs[k * count + i])).join(',')),
    );
    for (const limit of chunk.leftLimits) this.parts.left.push(toJsonString(LeftLimitSchema, limit, options));
  }

  finish(): Blob {
    const {title, job, analysis, summary, names} = this.solved;
    const list = (field: string) => ['[', this.parts[field].join(','), ']'];
    return new Blob(
      [
        `{"title":${JSON.stringify(title)},"job":${JSON.stringify(job)},`,
        analysis ? `"analysis":${toJsonString(AnalysisSchema, analysis, options)},` : '',
        summary ? `"summary":${toJsonString(SummarySchema, summary, options)},` : '',
        '"trajectory":{"first":0,"times":',
        ...list('times'),
        ',"x":',
        ...list('x'),
        ',"y":',
        ...list('y'),
        ',"left_limits":',
        ...list('left'),
        ',"w":',
        ...list('w'),
        ',"outputs":[]},"outputs":{',
        ...names.outputs.flatMap((name, i) => [
          `${i > 0 ? ',' : ''}${JSON.stringify(name)}:[`,
          this.outputs[i].join(','),
          ']',
        ]),
        '}}\n',
      ],
      {type: 'application/json'},
    );
  }
}

const options = {useProtoFieldName: true, alwaysEmitImplicit: true};

class CsvWriter implements Writer {
  private readonly parts: string[];

  constructor(solved: Solved) {
    this.parts = [header(solved).map(quoted).join(',') + '\n'];
  }

  add(chunk: TrajectoryChunk): void {
    this.parts.push(
      rowsOf(chunk)
        .map((row) => row.map(cell).join(',') + '\n')
        .join(''),
    );
  }

  finish(): Blob {
    return new Blob(this.parts, {type: 'text/csv'});
  }
}

function quoted(text: string): string {
  return /[,"\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

/** Outputs take the place of x, y and w; the name of one beside that of time is "output:t". */
function header({names, states, pairs}: Solved): string[] {
  if (names.outputs.length > 0) return ['t', ...names.outputs.map((name) => (name === 't' ? 'output:t' : name))];
  const head = ['t'];
  for (let i = 0; i < states; ++i) head.push(names.x(i));
  for (let i = 0; i < pairs; ++i) head.push(names.y(i));
  for (let i = 0; i < pairs; ++i) head.push(names.w(i));
  return head;
}

function cell(value: number): string {
  return Number.isFinite(value) ? (Object.is(value, -0) ? '-0' : String(value)) : '';
}

function rowsOf(chunk: TrajectoryChunk): number[][] {
  const times = chunk.times.length;
  return chunk.times.map((time, k) => {
    const row = [time];
    for (const values of chunk.outputs.length > 0 ? [chunk.outputs] : [chunk.x, chunk.y, chunk.w]) {
      const size = values.length / times;
      for (let i = 0; i < size; ++i) row.push(values[k * size + i]);
    }
    return row;
  });
}

/** One array, a row for each time, with the columns of the CSV. */
class NpyWriter implements Writer {
  private readonly parts: Float64Array<ArrayBuffer>[] = [];
  private rows = 0;

  constructor(private readonly solved: Solved) {}

  add(chunk: TrajectoryChunk): void {
    // Float64Array has the byte order of the machine, which is little-endian wherever browsers run.
    this.parts.push(Float64Array.from(rowsOf(chunk).flat()));
    this.rows += chunk.times.length;
  }

  finish(): Blob {
    const columns = header(this.solved).length;
    const text = `{'descr': '<f8', 'fortran_order': False, 'shape': (${this.rows}, ${columns}), }`;
    // 10 bytes of magic, version and length come first; data begins at a multiple of 64 bytes.
    const padded = text.padEnd(Math.ceil((10 + text.length + 1) / 64) * 64 - 11) + '\n';
    const start = new Uint8Array(10 + padded.length);
    start.set([0x93, ...new TextEncoder().encode('NUMPY'), 1, 0, padded.length & 0xff, padded.length >> 8]);
    start.set(new TextEncoder().encode(padded), 10);
    return new Blob([start, ...this.parts], {type: 'application/octet-stream'});
  }
}

export function save(blob: Blob, name: string): void {
  const address = URL.createObjectURL(blob);
  const link = document.createElement('a');
  link.href = address;
  link.download = name;
  link.click();
  // The browser reads the address when it starts the download, some time after the click.
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

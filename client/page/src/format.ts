// SPDX-License-Identifier: Apache-2.0
// Numbers, times and counts as the command line prints them.

import type {Timestamp} from '@bufbuild/protobuf/wkt';

/** "1 step", "1,000 steps". */
export function count(n: number | bigint, one: string): string {
  return `${n.toLocaleString('en-US')} ${one}${Number(n) === 1 ? '' : 's'}`;
}

/** At most `digits` significant digits, like %g: 0.25, 1e-6, 13.5. */
export function general(value: number, digits = 6): string {
  if (Number.isNaN(value)) return 'unknown';
  if (!Number.isFinite(value)) return value > 0 ? 'infinite' : '-infinite';
  if (value === 0) return '0';
  const [mantissa, exponent] = value.toExponential(digits - 1).split('e');
  const power = Number(exponent);
  if (power >= -5 && power < digits) return String(Number(value.toPrecision(digits)));
  return `${Number(mantissa)}e${power}`;
}

/** The shorter of 0.00002 and 2e-5, with at most `digits` significant digits. */
export function short(value: number, digits = 8): string {
  const plain = general(value, digits);
  const [mantissa, exponent] = value.toExponential(digits - 1).split('e');
  const scientific = `${Number(mantissa)}e${Number(exponent)}`;
  return scientific.length < plain.length && Number.isFinite(value) ? scientific : plain;
}

/** Two digits, as in 6.1e-11 or 0.25, for errors and residuals. */
export function size(value: number): string {
  if (!Number.isFinite(value)) return general(value);
  if (value === 0 || (Math.abs(value) >= 0.1 && Math.abs(value) < 1000)) return general(value, 2);
  return value.toExponential(1).replace('e+', 'e');
}

/** "12 s", "3 min", "2 h". */
export function duration(seconds: number): string {
  if (seconds < 0.995) return `${general(seconds, 2)} s`;
  if (seconds < 100) return `${Math.ceil(seconds)} s`;
  if (seconds < 6000) return `${Math.ceil(seconds / 60)} min`;
  return `${Math.ceil(seconds / 3600)} h`;
}

/** "12 s ago", or the date where it is longer than a day ago. */
export function ago(time: Timestamp | undefined, now = Date.now()): string {
  if (time === undefined) return '';
  const seconds = Math.max(0, (now - milliseconds(time)) / 1000);
  if (seconds > 86400) return new Date(milliseconds(time)).toLocaleDateString('en-US');
  return seconds < 1 ? 'now' : `${duration(Math.floor(seconds))} ago`;
}

export function milliseconds(time: Timestamp): number {
  return Number(time.seconds) * 1000 + time.nanos / 1e6;
}

export function bytes(n: number | bigint): string {
  let value = Number(n);
  for (const unit of ['bytes', 'KB', 'MB', 'GB']) {
    if (value < 1000 || unit === 'GB') return `${general(value, 3)} ${unit}`;
    value /= 1000;
  }
  return '';
}

/** The remaining time at the present speed; empty while the speed is unknown. */
export function timeLeft(elapsed: number, progress: number): string {
  if (elapsed < 1 || progress < 0.02 || progress >= 1) return '';
  return `about ${duration((elapsed * (1 - progress)) / progress)} left`;
}

// SPDX-License-Identifier: Apache-2.0
// The message of a failed call for the user, and the fields that it names.

import {Code, ConnectError} from '@connectrpc/connect';
import {BadRequestSchema, RetryInfoSchema} from '../../generated/google/rpc/error_details_pb';
import {duration} from '../format';

export interface Violation {
  /** The path in the request: problem.a[0][1], options.steps. */
  field: string;
  text: string;
}

export function violationsOf(error: unknown): Violation[] {
  if (!(error instanceof ConnectError)) return [];
  return error
    .findDetails(BadRequestSchema)
    .flatMap((detail) => detail.fieldViolations)
    .map(({field, description}) => ({field, text: description}));
}

export function errorText(error: unknown): string {
  const failed = ConnectError.from(error);
  const delay = failed.findDetails(RetryInfoSchema)[0]?.retryDelay;
  const seconds = delay === undefined ? 0 : Number(delay.seconds) + delay.nanos / 1e9;
  const retry = delay && !failed.rawMessage.includes('ry again') ? ` Try again in ${duration(seconds)}.` : '';
  switch (failed.code) {
    case Code.Unavailable:
    case Code.Unknown:
      return isNetworkError(failed) ? 'The server does not answer. Is it running?' : failed.rawMessage + retry;
    case Code.DeadlineExceeded:
      return 'The server did not answer in time.';
    case Code.PermissionDenied:
      return `The server does not allow it: ${failed.rawMessage}`;
    default:
      return failed.rawMessage + retry;
  }
}

/** The call may succeed if it is repeated: the connection broke, or the server restarts. */
export function isTransient(error: unknown): boolean {
  const {code} = ConnectError.from(error);
  return (
    code === Code.Unavailable ||
    code === Code.Unknown ||
    code === Code.Aborted ||
    code === Code.Internal ||
    code === Code.DeadlineExceeded
  );
}

// fetch reports a refused or broken connection as a TypeError, whose text differs between browsers.
function isNetworkError(error: ConnectError): boolean {
  return error.cause instanceof TypeError || /fetch|network/i.test(error.rawMessage);
}

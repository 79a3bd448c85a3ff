// SPDX-License-Identifier: Apache-2.0
// The services of the server that this page came from.

import {Code, ConnectError, createClient, type Interceptor} from '@connectrpc/connect';
import {createGrpcWebTransport} from '@connectrpc/connect-web';
import {JobService} from '../../generated/dlcs/v1/jobs_pb';
import {type GetCapabilitiesResponse, SolverService} from '../../generated/dlcs/v1/solver_pb';
import {askForToken, token} from './session';

const unaryTimeout = 20_000;

const withToken: Interceptor = (next) => async (request) => {
  for (;;) {
    const sent = token();
    if (sent !== '') request.header.set('authorization', `Bearer ${sent}`);
    try {
      return await next(request);
    } catch (error) {
      // A stream is refused while it is read, which its reader sees; see `loggedIn`.
      if (request.stream || !isUnauthenticated(error)) throw error;
      if (sent === token()) await askForToken(ConnectError.from(error).rawMessage);
    }
  }
};

// gRPC-Web rather than Connect: a refused call has HTTP status 200 there, so that browsers do not report it as an error
// of the page in their console.
const transport = createGrpcWebTransport({
  baseUrl: location.origin,
  useBinaryFormat: true,
  interceptors: [withToken],
});

export const solver = createClient(SolverService, transport);
export const jobs = createClient(JobService, transport);

/** The options of a short call. */
export function shortCall(): {timeoutMs: number} {
  return {timeoutMs: unaryTimeout};
}

function isUnauthenticated(error: unknown): boolean {
  return error instanceof ConnectError && error.code === Code.Unauthenticated;
}

/** For readers of streams: asks the user for a token if the error is that it is missing. Returns whether it was. */
export async function loggedIn(error: unknown): Promise<boolean> {
  if (!isUnauthenticated(error)) return false;
  await askForToken(ConnectError.from(error).rawMessage);
  return true;
}

let capabilities: Promise<GetCapabilitiesResponse> | null = null;

/** What the server offers; asked once. */
export function getCapabilities(): Promise<GetCapabilitiesResponse> {
  capabilities ??= solver.getCapabilities({}, shortCall()).catch((error) => {
    capabilities = null;
    throw error;
  });
  return capabilities;
}

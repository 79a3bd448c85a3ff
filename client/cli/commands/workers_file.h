// SPDX-License-Identifier: Apache-2.0
// The files of `dlcs workers`.

#ifndef DLCS_CLIENT_CLI_COMMANDS_WORKERS_FILE_H_
#define DLCS_CLIENT_CLI_COMMANDS_WORKERS_FILE_H_

#include <string>

#include "client/cli/commands/commands.h"

namespace dlcs::client {

// An array script for sbatch.
std::string SlurmScript(const WorkersCommand& command);

// A Deployment with its budget of disruptions and its autoscaler; or, with exit_when_idle_s, a Job.
// deploy/kubernetes/worker.yaml is the one of the default options.
std::string KubernetesManifest(const WorkersCommand& command);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_WORKERS_FILE_H_

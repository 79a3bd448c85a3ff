// SPDX-License-Identifier: Apache-2.0
#include "client/cli/commands/workers_file.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>

namespace dlcs::client {
namespace {

using namespace std::string_view_literals;

// Seconds before the time limit at which Slurm asks a worker to end. Jobs are given back within a few of them.
constexpr int kWarning_s = 60;
constexpr double kIdleUnderSlurm_s = 60;
constexpr double kTimeLimitUnderSlurm_s = 12 * 3600;
// The autoscaler adds workers if the queued work would take the present ones longer than this.
constexpr int kWantedWait_s = 600;

std::string QuotedForShell(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

// D-HH:MM:SS.
std::string SlurmTime(double seconds) {
  const auto s = static_cast<std::int64_t>(std::ceil(seconds));
  return fmt::format("{}-{:02}:{:02}:{:02}", s / 86400, s / 3600 % 24, s / 60 % 60, s % 60);
}

// In the units of Kubernetes.
std::string Quantity(double bytes) {
  if (std::fmod(bytes, 1e9) == 0) return fmt::format("{:.0f}G", bytes / 1e9);
  return fmt::format("{:.0f}M", std::ceil(bytes / 1e6));
}

// `template_text` with the fields of a Deployment or a Job around it.
std::string WorkerPod(const WorkersCommand& command, std::string_view indent_of_spec) {
  const bool ends = command.exit_when_idle_s > 0;
  const std::string store = nlohmann::json(command.store.empty() ? "postgresql://" : command.store).dump();
  const std::string text = fmt::format(
      R"(template:
  metadata:
    labels: {{app.kubernetes.io/component: worker}}
    annotations: {{prometheus.io/scrape: "true", prometheus.io/port: "9464", prometheus.io/path: /metrics}}
  spec:
    automountServiceAccountToken: false
    securityContext: {{runAsNonRoot: true, runAsUser: 65532, seccompProfile: {{type: RuntimeDefault}}}}
    terminationGracePeriodSeconds: 60
{restart}    containers:
      - name: dlcsd
        image: {image}
        args: [--role, worker, --listen, "0.0.0.0:50051", --store, {store},
               --insecure-listen, --metrics-listen, "0.0.0.0:9464", --threads, "{cpus}"{idle}]
        envFrom:
          - secretRef: {{name: {secret}}}
        ports:
          - {{name: grpc, containerPort: 50051}}
          - {{name: metrics, containerPort: 9464}}
        startupProbe: {{grpc: {{port: 50051}}, periodSeconds: 1, failureThreshold: 60}}
        livenessProbe: {{grpc: {{port: 50051}}, periodSeconds: 10, failureThreshold: 6}}
        # Nobody calls it, but an update stops where new workers do not reach the store.
        readinessProbe: {{grpc: {{port: 50051, service: dlcs.v1.JobService}}, periodSeconds: 5}}
        resources:
          # --threads above; what --max-memory-bytes and --max-held-result-bytes allow, and room beside.
          requests: {{cpu: "{cpus}", memory: {memory}}}
          limits: {{memory: {memory}}}
        securityContext:
          allowPrivilegeEscalation: false
          readOnlyRootFilesystem: true
          capabilities: {{drop: [ALL]}}
)",
      fmt::arg("restart", ends ? "    restartPolicy: OnFailure\n" : ""), fmt::arg("image", command.image),
      fmt::arg("store", store), fmt::arg("cpus", command.cpus),
      fmt::arg("idle",
               ends ? fmt::format(",\n               --exit-when-idle, \"{:.10g}\"", command.exit_when_idle_s) : ""),
      fmt::arg("secret", command.secret), fmt::arg("memory", Quantity(command.memory_bytes)));
  std::string indented;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin) + 1;
    indented += indent_of_spec;
    indented += text.substr(begin, end - begin);
    begin = end;
  }
  return indented;
}

std::string JobManifest(const WorkersCommand& command) {
  const std::string limit =
      command.time_limit_s > 0 ? fmt::format("  activeDeadlineSeconds: {:.0f}\n", std::ceil(command.time_limit_s)) : "";
  return fmt::format(
      R"(# SPDX-License-Identifier: Apache-2.0
# Solves jobs until there are none to claim. If it is killed, other workers resume its jobs from the last checkpoint.
apiVersion: batch/v1
kind: Job
metadata:
  name: dlcs-worker
spec:
  # Without `completions` it is done when one worker has found nothing to do and all have ended.
  parallelism: {}
{}  ttlSecondsAfterFinished: 86400
{})",
      command.count, limit, WorkerPod(command, "  "));
}

}  // namespace

std::string SlurmScript(const WorkersCommand& command) {
  const double limit = command.time_limit_s > 0 ? command.time_limit_s : kTimeLimitUnderSlurm_s;
  const double idle = command.exit_when_idle_s > 0 ? command.exit_when_idle_s : kIdleUnderSlurm_s;
  return fmt::format(
      R"(#!/bin/bash
# Workers of dlcs for sbatch. Each solves jobs of the store until there was none to claim for a while, or until its time
# is up; then it gives back what it has not finished, and another continues from where that was last stored.
#SBATCH --job-name=dlcs-worker
#SBATCH --array=1-{count}
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task={cpus}
#SBATCH --mem={megabytes:.0f}M
#SBATCH --time={time}
{partition}#SBATCH --requeue
#SBATCH --open-mode=append
# To the script's own process, which is dlcsd, before the time is up.
#SBATCH --signal=B:TERM@{warning}

# A worker that is requeued has the name that it had, and so finds its jobs at once. Several may share a node: any port.
exec {program} --role worker --store {store} --listen 127.0.0.1:0 --threads {cpus} \
  --worker-name "slurm-$SLURM_ARRAY_JOB_ID-$SLURM_ARRAY_TASK_ID" --exit-when-idle {idle:.10g}
)",
      fmt::arg("count", command.count), fmt::arg("cpus", command.cpus),
      fmt::arg("megabytes", std::ceil(command.memory_bytes / (1 << 20))), fmt::arg("time", SlurmTime(limit)),
      fmt::arg("partition",
               command.partition.empty() ? "" : fmt::format("#SBATCH --partition={}\n", command.partition)),
      fmt::arg("warning", kWarning_s), fmt::arg("program", command.program),
      fmt::arg("store", QuotedForShell(command.store)), fmt::arg("idle", idle));
}

std::string KubernetesManifest(const WorkersCommand& command) {
  if (command.exit_when_idle_s > 0) return JobManifest(command);
  const bool scales = command.most > command.count;
  std::string text = fmt::format(
      R"(# SPDX-License-Identifier: Apache-2.0
# Solves jobs: claims them from the store, and releases them when it is stopped. If it is killed, other workers resume
# its jobs from the last checkpoint. Written by `dlcs workers kubernetes`.
apiVersion: apps/v1
kind: Deployment
metadata:
  name: dlcs-worker
spec:
{replicas}
  selector: {{matchLabels: {{app.kubernetes.io/component: worker}}}}
{pod}---
apiVersion: policy/v1
kind: PodDisruptionBudget
metadata:
  name: dlcs-worker
spec:
  # One at a time: each gives its jobs back first.
  maxUnavailable: 1
  selector: {{matchLabels: {{app.kubernetes.io/component: worker}}}}
)",
      fmt::arg("replicas",
               scales ? "  # As many as the autoscaler says." : fmt::format("  replicas: {}", command.count)),
      fmt::arg("pod", WorkerPod(command, "  ")));
  if (!scales) return text;
  return text + fmt::format(
                    R"(---
apiVersion: autoscaling/v2
kind: HorizontalPodAutoscaler
metadata:
  name: dlcs-worker
spec:
  scaleTargetRef: {{apiVersion: apps/v1, kind: Deployment, name: dlcs-worker}}
  minReplicas: {least}
  maxReplicas: {most}
  metrics:
    # Work that waits, as every front sees it in the store: max(...) over them, by prometheus-adapter or the like.
    - type: External
      external:
        metric: {{name: dlcs_jobs_queued_core_seconds}}
        # What waits would take all workers ten minutes: 600 s for each core of one.
        target: {{type: AverageValue, averageValue: "{seconds}"}}
  behavior:
    scaleDown: {{stabilizationWindowSeconds: 600}}
)",
                    fmt::arg("least", command.count), fmt::arg("most", command.most),
                    fmt::arg("seconds", command.cpus * kWantedWait_s));
}

}  // namespace dlcs::client

// SPDX-License-Identifier: Apache-2.0
#include "client/cli/workers_command_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string>

#include "client/cli/options/option_kinds.h"
#include "client/cli/solve_options.h"

namespace dlcs::client {
namespace {

using Manager = WorkersCommand::Manager;

constexpr const char* kExamples =
    "Nothing is started: the script is for sbatch, the manifest for kubectl. Workers run the jobs of the store, which "
    "fronts\n"
    "accept (dlcsd --role front). The store's password belongs into ~/.pgpass, or into the secret.\n"
    "\n"
    "Examples:\n"
    "  dlcs workers slurm --store postgresql://dlcs@db/dlcs --count 8 --time-limit 12h --output workers.sh\n"
    "  sbatch workers.sh\n"
    "  dlcs workers kubernetes --image registry.example/dlcs:0.1.0 | kubectl --namespace dlcs apply --filename -\n"
    "  dlcs workers kubernetes --exit-when-idle 5m --count 8        a Job that ends when the queue is empty";

void AddDuration(CLI::App& app, const std::string& name, double least, double& seconds, const std::string& help) {
  app.add_option_function<std::string>(
         name,
         [=, &seconds](const std::string& text) {
           seconds = ParseDuration(text, name);
           if (seconds >= least && seconds <= 365 * 86400.0) return;
           throw CLI::ValidationError(name, fmt::format("{} must be between {} s and 365d", text, least));
         },
         help)
      ->type_name("TIME");
}

// A text that is written into a file where other characters would have a meaning.
void AddPlainText(CLI::App& app, const std::string& name, std::string& value, const char* metavariable,
                  const std::string& help) {
  const auto check = [](const std::string& text) -> std::string {
    const bool is_plain = std::all_of(text.begin(), text.end(), [](unsigned char c) {
      return std::isalnum(c) != 0 || std::string_view("._/:@-,").find(static_cast<char>(c)) != std::string_view::npos;
    });
    if (is_plain && !text.empty() && text.front() != '-') return "";
    return fmt::format("\"{}\" must have only letters, digits and . _ / : @ - , and not begin with -", text);
  };
  app.add_option(name, value, help)->check(CLI::Validator(check, ""))->type_name(metavariable);
}

CLI::Option* AddStore(CLI::App& app, std::string& store, const std::string& help) {
  const auto check = [](const std::string& text) -> std::string {
    const bool is_address = text.starts_with("postgresql://") || text.starts_with("postgres://");
    if (!is_address) return fmt::format("\"{}\" must be postgresql://USER@HOST/NAME, which servers can share", text);
    if (std::any_of(text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c) != 0; })) {
      return "must be one line";
    }
    const std::size_t host = text.find("//") + 2;
    const std::string user = text.substr(host, text.find_first_of("/?", host) - host);
    const std::size_t at = user.rfind('@');
    const bool has_password = (at != std::string::npos && user.find(':') < at) ||
                              text.find("?password=") != std::string::npos ||
                              text.find("&password=") != std::string::npos;
    if (has_password) return "has a password, which all who can read the file would know; ~/.pgpass is for that";
    return "";
  };
  return app.add_option("--store", store, help)->check(CLI::Validator(check, ""))->type_name("ADDRESS");
}

void AddSize(CLI::App& app, WorkersCommand& command) {
  AddNumber(
      app, "--count", "N", Whole("a whole number between 1 and 10000", 1, 10000),
      [&command](double v) { command.count = static_cast<int>(v); }, fmt::format("Workers ({})", command.count));
  AddNumber(
      app, "--cpus", "N", Whole("a whole number between 1 and 1024", 1, 1024),
      [&command](double v) { command.cpus = static_cast<int>(v); },
      fmt::format("Cores of each worker, as --threads of the fronts ({})", command.cpus));
  app.add_option_function<std::string>(
         "--memory",
         [&command](const std::string& text) {
           command.memory_bytes = ParseBytes(text, "--memory");
           if (command.memory_bytes >= 1e8 && command.memory_bytes <= 1e14) return;
           throw CLI::ValidationError("--memory", fmt::format("{} must be between 100MB and 100TB", text));
         },
         "Memory of each: --max-memory-bytes and --max-held-result-bytes together, and some reserve (8GB)")
      ->type_name("BYTES");
}

}  // namespace

void AddWorkers(CLI::App& main, WorkersCommand& command) {
  CLI::App& app = *main.add_subcommand("workers", "Write what starts workers under Slurm or in Kubernetes");
  app.require_subcommand(1);

  CLI::App& slurm = *app.add_subcommand("slurm", "Write an array script for sbatch");
  slurm.callback([&command] { command.manager = Manager::kSlurm; });
  AddStore(slurm, command.store,
           "The store of jobs that the workers share with the fronts: postgresql://USER@HOST/NAME")
      ->required();
  AddSize(slurm, command);
  AddPlainText(slurm, "--partition", command.partition, "NAME", "Slurm's partition (its default)");
  AddDuration(slurm, "--time-limit", 120, command.time_limit_s,
              "After this a worker gives its jobs back and ends (12h)");
  AddDuration(slurm, "--exit-when-idle", 1, command.exit_when_idle_s,
              "A worker ends when there was no job to claim for this long (60s)");
  AddPlainText(slurm, "--program", command.program, "PATH", "The program on the machines of the cluster (dlcsd)");

  CLI::App& kubernetes = *app.add_subcommand("kubernetes", "Write a manifest for kubectl");
  kubernetes.callback([&command] { command.manager = Manager::kKubernetes; });
  AddStore(kubernetes, command.store, "The store of jobs (postgresql://, completed by the secret)");
  AddSize(kubernetes, command);
  AddNumber(
      kubernetes, "--most", "N", Whole("a whole number between 1 and 10000", 1, 10000),
      [&command](double v) { command.most = static_cast<int>(v); },
      fmt::format("The autoscaler adds workers up to this number ({}); --count or less: there is none", command.most));
  AddPlainText(kubernetes, "--image", command.image, "IMAGE", "The image of deploy/Dockerfile (dlcs)");
  AddPlainText(kubernetes, "--secret", command.secret, "NAME",
               "The secret with PGHOST, PGUSER, PGPASSWORD, ... (dlcs-postgresql)");
  AddDuration(kubernetes, "--exit-when-idle", 1, command.exit_when_idle_s,
              "Write a Job: its workers end when there was no job to claim for this long (a Deployment, which does not "
              "end)");
  AddDuration(kubernetes, "--time-limit", 120, command.time_limit_s,
              "With --exit-when-idle: the Job is ended after this");

  for (CLI::App* sub : app.get_subcommands({})) {
    AddOutput(*sub, command.output, sub == &slurm ? "the script" : "the manifest");
    sub->footer(kExamples);
  }
  app.footer(kExamples);
}

}  // namespace dlcs::client

// SPDX-License-Identifier: Apache-2.0
#include "server/flags.h"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <vector>

#include "CLI/CLI.hpp"
#include "fmt/format.h"
#include "proto/shared/nearest_name.h"
#include "proto/shared/truncate_text.h"
#include "server/config/config_file.h"
#include "server/dlcs_server.h"
#include "server/session/version.h"
#include "server/store/store_location.h"

namespace dlcs {
namespace {

constexpr std::size_t kMaxShownBytes = 80;  // of an unknown name

constexpr const char* kFooter =
    "Every flag is also a variable and a key of the file that --config names: --max-steps 1000, DLCSD_MAX_STEPS=1000,\n"
    "max-steps = 1000. The flag takes precedence over the variable, and the variable over the file.\n\n"
    "Prints a line on standard output when it is ready: dlcsd listening on HOST:PORT. With --http-listen the next one\n"
    "is the address of the page.\n"
    "SIGTERM and SIGINT end it: no new solves, running ones get the grace period, then they are stopped and deliver\n"
    "their summary. A second signal skips the rest of the grace period. SIGHUP looks for changed certificates and "
    "tokens\n"
    "at once.\n"
    "Exit status: 0 after a signal or --exit-when-idle, 2 for a bad setting, 3 when it cannot listen.\n\n"
    "Examples:\n"
    "  dlcsd                                     serve this machine on port 50051\n"
    "  dlcsd --listen 127.0.0.1:0                on any free port, which is printed\n"
    "  dlcsd --threads 4                         four threads per solve\n"
    "  dlcsd --store jobs.db                     accept jobs too, which survive restarts\n"
    "  dlcsd --store jobs.db --http-listen 127.0.0.1:8080\n"
    "                                            and show them in a browser, http://127.0.0.1:8080/\n"
    "  dlcsd --store postgresql://dlcs@db/dlcs --role worker --listen 127.0.0.1:0\n"
    "                                            run the jobs that other servers accept\n"
    "  dlcsd --listen 0.0.0.0:50051 --tls-cert server.pem --tls-key server.key --tokens tokens.txt\n"
    "                                            serve the network, to users with tokens\n"
    "  dlcsd --config dlcsd.conf --check-config  check and print these settings";

constexpr const char* kLongIdle = "60";  // seconds, of --exit-when-idle without a value

// "90", "90s", "30m", "12h", "7d".
CLI::Option* AddAge(CLI::App& app, const char* name, double& seconds, const char* help) {
  const auto in_seconds = [](std::string& text) -> std::string {
    const std::map<std::string, double> units = {{"", 1}, {"s", 1}, {"m", 60}, {"h", 3600}, {"d", 86400}};
    double number = 0;
    const char* const end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, number);
    const auto unit = units.find(std::string(rest, end));
    const bool sound = error == std::errc() && std::isfinite(number) && number >= 0 && unit != units.end();
    if (!sound) {
      return fmt::format("\"{}\" is not a duration; write seconds, or 90s, 30m, 12h, 7d",
                         TruncateUtf8(text, kMaxShownBytes));
    }
    text = fmt::format("{}", number * unit->second);
    return "";
  };
  return app.add_option(name, seconds, help)->transform(CLI::Validator(in_seconds, ""))->type_name("AGE");
}

// As a switch it is true or false in a file.
void AddExitWhenIdle(CLI::App& app, double& seconds) {
  const auto word_in_seconds = [](std::string& text) -> std::string {
    if (text == "true") text = kLongIdle;
    if (text == "false") text = "0";
    return "";
  };
  AddAge(app, "--exit-when-idle", seconds,
         "A worker ends, with exit status 0, when there has been no job to claim for this long; without a value: 60s")
      ->expected(0, 1)
      ->default_str("true")
      ->type_name("[AGE]")
      ->transform(CLI::Validator(word_in_seconds, ""));
}

// Flags about jobs and uploaded problems; without --store they have no effect.
void AddJobFlags(CLI::App& app, ServerConfig& config) {
  app.add_option("--max-job-core-seconds", config.max_job_core_seconds, "Largest job, as predicted");
  app.add_option("--max-queued-jobs", config.max_queued_jobs, "Most jobs waiting");
  app.add_option("--max-queued-jobs-per-user", config.max_queued_jobs_per_user, "Most jobs of one user waiting");
  app.add_option("--max-queued-core-seconds", config.max_queued_core_seconds, "All queued jobs together, as predicted");
  app.add_option("--max-job-attempts", config.max_job_attempts,
                 "A job that was started this often without progress fails");
  AddAge(app, "--keep-finished", config.keep_finished_s, "How long a job that has ended is kept: 90s, 30m, 12h, 7d");
  app.add_option("--keep-finished-bytes", config.keep_finished_bytes,
                 "Most bytes of jobs that have ended; the oldest are deleted first");
  app.add_option("--max-upload-bytes", config.max_upload_bytes, "Largest uploaded problem");
  app.add_option("--max-uploaded-bytes-per-user", config.max_uploaded_bytes_per_user,
                 "All uploaded problems of one user together");
  app.add_option("--max-uploaded-problems-per-user", config.max_uploaded_problems_per_user,
                 "Most uploaded problems of one user");
  AddAge(app, "--keep-problems", config.keep_problems_s,
         "How long an uploaded problem is kept since its last use; one that a job needs stays");
}

void AddAccessFlags(CLI::App& app, AccessSettings& access) {
  app.add_option("--tls-cert", access.tls_cert, "Certificate of this server, PEM; read again when it changes")
      ->type_name("FILE");
  app.add_option("--tls-key", access.tls_key, "Its private key, PEM")->type_name("FILE");
  app.add_option("--tls-client-ca", access.tls_client_ca,
                 "Authorities of clients, PEM: only clients with a certificate of theirs may connect")
      ->type_name("FILE");
  app.add_option("--tokens", access.tokens,
                 "Users, one per line; read again when it changes. Without it every caller may do everything")
      ->type_name("FILE");
  app.add_flag("--insecure-listen", access.insecure_listen,
               "Serve other machines without encryption: only on a trusted network, or behind a proxy that encrypts");
  app.add_option("--max-streams-per-connection", access.max_streams_per_connection,
                 "Calls at the same time on one connection; more wait at the client");
  app.add_option("--max-watches-per-user", access.max_watches_per_user, "Jobs that one user watches at the same time");
}

// An option whose values are `words`.
void AddWord(CLI::App& app, const std::string& name, std::string& value, const std::vector<std::string>& words,
             const std::string& help) {
  const auto check = [words](const std::string& given) -> std::string {
    if (std::find(words.begin(), words.end(), given) != words.end()) return "";
    return fmt::format("\"{}\" is none of {}{}", TruncateUtf8(given, kMaxShownBytes), fmt::join(words, ", "),
                       DidYouMean(NearestName(given, words)));
  };
  app.add_option(name, value, help)->check(check)->type_name(fmt::format("{}", fmt::join(words, "|")));
}

void AddTokenCommand(CLI::App& app, TokenRequest& wanted) {
  CLI::App& token = *app.add_subcommand("token", "Make a token for a user, and print the line for --tokens");
  token.add_option("NAME", wanted.user, "The user, in letters, digits or . _ @ : / + -")->required()->type_name("");
  AddWord(token, "--right", wanted.right, {"reader", "submitter", "admin"}, "What the user may do");
  token
      .add_option("--save", wanted.save,
                  "Write the token to this file, readable by its owner only, and not to standard error")
      ->type_name("FILE");
  token.footer(
      "A reader may read its own jobs; a submitter may also solve and submit jobs; an admin may do so for all "
      "users.\n\n"
      "Example:\n"
      "  dlcsd token alice --save alice.token >> tokens.txt");
}

void AddFlags(CLI::App& app, Flags& flags) {
  ServerConfig& config = flags.config;
  app.add_option("--listen", config.listen, "HOST:PORT, where port 0 picks a free one; or unix:/PATH");
  AddAccessFlags(app, config.access);
  app.add_option(
      "--http-listen", config.http_listen,
      "HOST:PORT of the web page, and of calls by browsers and scripts: Connect, gRPC-Web and JSON over HTTP "
      "(default: not served). Encrypted as --listen is");
  app.add_option("--http-origins", config.http_origins,
                 "Other sites whose pages may call, with commas: https://plots.example.org");
  app.add_option(
      "--http-hosts", config.http_hosts,
      "Further names of this server in requests over HTTP, with commas; IP addresses, localhost and the host "
      "of --http-listen are known");
  app.add_option("--metrics-listen", config.metrics_listen,
                 "HOST:PORT of /metrics for Prometheus, /livez and /readyz, over plain HTTP (default: not served)");
  app.add_flag("--reflection", config.reflection, "Describe the services to callers that have no .proto files");
  app.add_option("--max-concurrent-solves", config.max_concurrent_solves,
                 "Solves at once, more are refused; 0: one per processor, at least 2");
  app.add_option("--threads", config.threads, "Threads of one solve; 0: all processors");
  app.add_option("--max-states", config.max_states, "Largest number of states (rows of A)");
  app.add_option("--max-dense-states", config.max_dense_states, "The same for dense A");
  app.add_option("--max-constraints", config.max_constraints, "Largest number of pairs (rows of M)");
  app.add_option("--max-steps", config.max_steps, "Most steps of one solve");
  app.add_option("--max-members", config.max_members, "Most members of one ensemble");
  app.add_option("--max-result-bytes", config.max_result_bytes, "Largest trajectory of one solve");
  app.add_option("--max-held-result-bytes", config.max_held_result_bytes, "All trajectories in memory together");
  app.add_option("--max-memory-bytes", config.max_memory_bytes, "Most memory that one solve may allocate");
  app.add_option("--setup-cache-bytes", config.setup_cache_bytes,
                 "Matrix functions and factors kept for further solves of the same matrices; 0 keeps none");
  app.add_option(
      "--store", config.store,
      "Store of jobs: a file, created if there is none, or postgresql://USER@HOST/NAME, which several servers share; "
      "without it the server accepts no jobs");
  AddWord(app, "--role", config.role, {"all", "front", "worker"},
          "front: serves calls and leaves jobs to workers; worker: runs jobs and serves no calls");
  app.add_option("--worker-name", config.worker_name,
                 "Name of this server on a shared store, the same after a restart (HOST:PORT)");
  AddExitWhenIdle(app, config.exit_when_idle_s);
  app.add_option("--lease-ms", config.lease_ms,
                 "If a server does not renew its lease for this long, others resume its jobs");
  app.add_option("--mpi-launcher", config.mpi_launcher,
                 "Command that starts the MPI processes of a job, as in \"mpirun -n {ranks}\" (default: none)");
  app.add_option("--mpi-program", config.mpi_program,
                 "Program that the launcher starts: a path, or a name in the folder of dlcsd or in PATH");
  app.add_option("--mpi-host", config.mpi_host, "Name or address of this machine at which those processes reach it");
  app.add_option("--mpi-patience-ms", config.mpi_patience_ms,
                 "If one of those processes sends no heartbeat for this long, its job is resumed");
  app.add_option(
      "--max-ranks", config.max_ranks,
      "Largest number of MPI processes of one job; 0: one per processor, with --mpi-launcher. A front needs it");
  app.add_option("--checkpoint-ms", config.checkpoint_ms, "How often the progress of a running job is stored");
  AddJobFlags(app, config);
  app.add_option("--max-message-bytes", config.max_message_bytes, "Largest request");
  app.add_option("--grace", flags.grace_s, "Seconds that running solves are given on SIGTERM or SIGINT")
      ->check([](const std::string& text) -> std::string {
        double seconds = 0;
        const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), seconds);
        const bool sound =
            error == std::errc() && rest == text.data() + text.size() && seconds >= 0 && seconds <= 86400;
        return sound ? ""
                     : fmt::format("\"{}\" is not a number of seconds between 0 and 86400",
                                   TruncateUtf8(text, kMaxShownBytes));
      });
  AddWord(app, "--log-level", flags.log_level, {"debug", "info", "warn", "error", "off"},
          "Lowest level of the lines on standard error");
  AddWord(app, "--log-format", flags.log_format, {"text", "json"}, "Lines of text, or one JSON object per line");
}

std::string VariableOf(const std::string& key) {
  std::string name = "DLCSD_" + key;
  std::replace(name.begin(), name.end(), '-', '_');
  for (char& c : name) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return name;
}

// The end of a message about an unknown setting.
std::string Proposal(const std::string& name, const std::vector<std::string>& known) {
  const std::string meant = DidYouMean(NearestName(name, known));
  return meant.empty() ? "; dlcsd --help lists all" : meant;
}

// Kubernetes sets variables for all services in every container; these are for a service named dlcsd.
bool IsOfKubernetes(const std::string& variable) {
  return variable.rfind("DLCSD_SERVICE_", 0) == 0 || variable.rfind("DLCSD_PORT", 0) == 0;
}

bool IsSet(const std::string& variable) {
  const char* const value = std::getenv(variable.c_str());
  return value != nullptr && *value != '\0';
}

bool IsSetting(const CLI::Option* option) { return option->get_configurable(); }

std::vector<std::string> KeysOf(const CLI::App& app) {
  std::vector<std::string> keys;
  for (const CLI::Option* const option : app.get_options(&IsSetting)) keys.push_back(option->get_single_name());
  return keys;
}

bool IsWhole(const CLI::Option& option) { return option.get_type_name().find("INT") != std::string::npos; }
bool IsSwitch(const CLI::Option& option) { return option.get_expected_min() == 0; }

// CLI11 reads numbers that are too large as the largest one, and 010 as eight.
std::string WholeNumberError(const std::string& text) {
  std::int64_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  if (error == std::errc() && rest == end) return "";
  if (error == std::errc::result_out_of_range) return fmt::format("{} is too large a number", text);
  return fmt::format("\"{}\" is not a whole number; write digits alone, as in 4", text);
}

// Why the file of --config cannot be read.
std::string WhyUnreadable(const std::string& path) {
  std::FILE* const file = std::fopen(path.c_str(), "r");
  const int error = file == nullptr ? errno : EISDIR;  // a folder opens, and then cannot be read
  if (file != nullptr) std::fclose(file);
  return fmt::format("--config {}: {}; give the path of a file with one setting per line", path, std::strerror(error));
}

// Help without the variable at every flag: the footer has the rule.
class HelpText final : public CLI::Formatter {
  std::string make_option_opts(const CLI::Option* option) const override {
    const std::string text = CLI::Formatter::make_option_opts(option);
    return text.substr(0, text.find(" (Env:"));
  }
};

// The configuration file for CLI11, which would give it precedence over the environment.
class SettingsFile final : public CLI::ConfigBase {
 public:
  // `origins` gets FILE:LINE of every key. Both must outlive it.
  SettingsFile(const CLI::App& app, std::map<std::string, std::string>& origins) : app_(app), origins_(origins) {}

  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override {
    const auto path = app_.get_config_ptr()->as<std::string>();
    const absl::StatusOr<std::vector<Setting>> settings = ReadSettings(input, path);
    if (!settings.ok()) throw CLI::ConfigError(std::string(settings.status().message()), CLI::ExitCodes::ConfigError);
    std::vector<CLI::ConfigItem> read;
    for (const Setting& setting : *settings) {
      const std::string place = fmt::format("{}:{}", path, setting.line);
      const CLI::Option* const option = app_.get_option_no_throw("--" + setting.key);
      if (option == nullptr || !option->get_configurable()) {
        throw CLI::ConfigError(
            fmt::format("{}: {}: there is no such setting{}", place, TruncateUtf8(setting.key, kMaxShownBytes),
                        Proposal(setting.key, KeysOf(app_))),
            CLI::ExitCodes::ConfigError);
      }
      if (option->count() > 0 || IsSet(option->get_envname())) continue;
      origins_[setting.key] = place;
      CLI::ConfigItem& item = read.emplace_back();
      item.name = setting.key;
      item.inputs = {setting.value};
    }
    return read;
  }

 private:
  const CLI::App& app_;
  std::map<std::string, std::string>& origins_;
};

// The command line of one run of the program.
class CommandLine {
 public:
  CommandLine(int argc, char** argv, Flags& flags)
      : words_(argv + 1, argv + argc),
        flags_(flags),
        app_("dlcsd solves differential linear complementarity systems over gRPC.", "dlcsd") {
    app_.option_defaults()->always_capture_default();
    app_.set_version_flag("--version", fmt::format("dlcsd {} ({})", kVersion, BuildText()))->configurable(false);
    app_.get_help_ptr()->configurable(false);
    const char* const path = std::getenv("DLCSD_CONFIG");
    app_.set_config("--config", path == nullptr ? "" : path, "Configuration file, one key = value per line",
                    IsSet("DLCSD_CONFIG"))
        ->configurable(false);
    app_.config_formatter(std::make_shared<SettingsFile>(app_, origins_));
    app_.add_flag("--check-config", check_only_, "Check and print all settings and where they come from, then exit")
        ->configurable(false);
    AddFlags(app_, flags);
    AddTokenCommand(app_, new_token_);
    for (CLI::Option* const option : app_.get_options(&IsSetting)) {
      option->envname(VariableOf(option->get_single_name()));
      if (IsWhole(*option)) option->check(WholeNumberError);
    }
    app_.formatter(std::make_shared<HelpText>());
    app_.footer(kFooter);
  }

  // False if the program should exit with `exit_status`.
  bool Read(int& exit_status) {
    exit_status = 0;
    try {
      app_.parse(std::vector<std::string>(words_.rbegin(), words_.rend()));
    } catch (const CLI::Success& asked) {
      app_.exit(asked);
      return false;
    } catch (const CLI::ParseError& error) {
      exit_status = Refuse(Explain(error));
      return false;
    }
    if (app_.got_subcommand("token")) {
      flags_.new_token = new_token_;
      return true;
    }
    absl::Status valid = Validate(flags_.config);
    if (valid.ok()) valid = CheckStoreLocation(flags_.config.store);
    if (check_only_ && valid.ok()) valid = DlcsServer::Check(flags_.config);
    if (!valid.ok()) {
      exit_status = Refuse(std::string(valid.message()));
      return false;
    }
    WarnOfVariables();
    if (check_only_) {
      Print();
      for (const std::string& warning : flags_.warnings) std::fprintf(stderr, "dlcsd: %s\n", warning.c_str());
    }
    return !check_only_;
  }

 private:
  static std::string NoSuchFlag(const std::string& word, const std::vector<std::string>& keys) {
    const std::string name = word.substr(0, word.find('='));
    std::vector<std::string> flags = {"--config", "--check-config", "--help", "--version"};
    for (const std::string& key : keys) flags.push_back("--" + key);
    return fmt::format("{}: there is no such flag{}", TruncateUtf8(name, kMaxShownBytes), Proposal(name, flags));
  }

  void WarnOfVariables() {
    std::vector<std::string> known = {"DLCSD_CONFIG"};
    for (const std::string& key : KeysOf(app_)) known.push_back(VariableOf(key));
    for (char** entry = environ; *entry != nullptr; ++entry) {
      const std::string text = *entry, name = text.substr(0, text.find('='));
      if (name.rfind("DLCSD_", 0) != 0 || IsOfKubernetes(name)) continue;
      if (std::find(known.begin(), known.end(), name) != known.end()) continue;
      flags_.warnings.push_back(fmt::format("{} is set, but there is no such setting{}",
                                            TruncateUtf8(name, kMaxShownBytes), Proposal(name, known)));
    }
  }

  bool IsFlag(const std::string& name) const {
    return std::any_of(words_.begin(), words_.end(), [flag = "--" + name](const std::string& word) {
      return word == flag || word.compare(0, flag.size() + 1, flag + "=") == 0;
    });
  }

  // "flag", "DLCSD_MAX_STEPS", "dlcsd.conf:7"; empty for a default.
  std::string OriginOf(const CLI::Option& option) const {
    const std::string name = option.get_single_name();
    if (IsFlag(name)) return "flag";
    if (IsSet(option.get_envname())) return option.get_envname();
    const auto origin = origins_.find(name);
    return origin == origins_.end() ? "" : origin->second;
  }

  // The setting that `message` names first.
  const CLI::Option* NamedIn(const std::string& message) const {
    const CLI::Option* named = nullptr;
    std::size_t place = message.size();
    for (const CLI::Option* const option : app_.get_options(&IsSetting)) {
      const std::string name = "--" + option->get_single_name();
      const std::size_t begin = message.find(name);
      if (begin >= place) continue;
      const char next = message.c_str()[begin + name.size()];
      if (next == '-' || std::isalnum(static_cast<unsigned char>(next)) != 0) continue;  // a longer name
      named = option;
      place = begin;
    }
    return named;
  }

  // The message of CLI11, with the rule if it has none.
  std::string Explain(const CLI::ParseError& error) const {
    switch (static_cast<CLI::ExitCodes>(error.get_exit_code())) {
      case CLI::ExitCodes::ExtrasError:
        return NoSuchFlag(app_.remaining().front(), KeysOf(app_));
      case CLI::ExitCodes::FileError:
        return WhyUnreadable(app_.get_config_ptr()->as<std::string>());
      case CLI::ExitCodes::ConversionError:
        if (const CLI::Option* const option = NamedIn(error.what())) {
          return fmt::format("--{} {}: must be {}", option->get_single_name(), fmt::join(option->results(), " "),
                             IsSwitch(*option)  ? "true or false"
                             : IsWhole(*option) ? "a smaller number"
                                                : "a number");
        }
        return error.what();
      default:
        return error.what();
    }
  }

  int Refuse(const std::string& message) const {
    const CLI::Option* const option = NamedIn(message);
    const std::string origin = option == nullptr ? "" : OriginOf(*option);
    const bool shows_origin = !origin.empty() && origin != "flag";
    const std::string suffix = shows_origin ? " (" + origin + ")" : "";
    std::fprintf(stderr, "dlcsd: %s\n", (WithoutPassword(message) + suffix).c_str());
    return 2;
  }

  // Prints the settings as a configuration file.
  void Print() const {
    for (const CLI::Option* const option : app_.get_options(&IsSetting)) {
      std::string value = IsSwitch(*option) ? "false" : option->get_default_str();
      if (option->count() > 0) value = fmt::format("{}", fmt::join(option->results(), " "));
      const std::string line = WriteSetting(option->get_single_name(), WithoutPassword(value));
      const std::string origin = OriginOf(*option);
      std::printf("%s\n", origin.empty() ? line.c_str() : fmt::format("{:<40} # {}", line, origin).c_str());
    }
  }

  const std::vector<std::string> words_;
  Flags& flags_;
  TokenRequest new_token_;
  CLI::App app_;
  std::map<std::string, std::string> origins_;
  bool check_only_ = false;
};

}  // namespace

std::optional<Flags> ReadFlags(int argc, char** argv, int& exit_status) {
  Flags flags;
  if (!CommandLine(argc, argv, flags).Read(exit_status)) return std::nullopt;
  return flags;
}

}  // namespace dlcs

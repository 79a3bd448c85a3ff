// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/rank_launcher.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <numeric>
#include <string_view>
#include <thread>

#include "fmt/format.h"
#include "fmt/ranges.h"
#include "proto/shared/truncate_text.h"
#include "spdlog/spdlog.h"

namespace dlcs {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr char kRanks[] = "{ranks}";
constexpr milliseconds kLauncherPollInterval{20};
constexpr milliseconds kTerminateTimeout{3000};
constexpr std::size_t kMaxLineBytes = 1000;
constexpr std::size_t kKeptBytes = 600;  // of the last output

bool IsProgram(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error) && access(path.c_str(), X_OK) == 0;
}

// The path of the program that a shell would run; empty if there is none.
std::string FindProgram(const std::string& name) {
  if (name.find('/') != std::string::npos) return IsProgram(name) ? name : "";
  const char* const variable = std::getenv("PATH");
  const std::string folders = variable == nullptr ? "" : variable;
  for (std::size_t begin = 0; begin <= folders.size();) {
    const std::size_t end = std::min(folders.find(':', begin), folders.size());
    const std::filesystem::path path = std::filesystem::path(folders.substr(begin, end - begin)) / name;
    if (path.is_absolute() && IsProgram(path)) return path;
    begin = end + 1;
  }
  return "";
}

std::string FindRankProgram(const std::string& name) {
  std::error_code error;
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", error);
  if (name.find('/') == std::string::npos && !error && IsProgram(own.parent_path() / name)) {
    return own.parent_path() / name;
  }
  return FindProgram(name);
}

// Programs may print any bytes.
std::string Printable(std::string text) {
  const auto is_unprintable = [](char c) { return c < ' ' || c > '~'; };
  std::replace_if(text.begin(), text.end(), is_unprintable, '?');
  return text;
}

// Whether Open MPI says so of a process that crashes, launchers among them when a rank was killed: addresses on the
// stack, as in "[node:17] [ 3] /lib/libc.so.6(+0x3c050)[0x7fc5]", and what frames them.
bool IsOfCrash(const std::string& line) {
  const std::size_t end = line.find("] ");
  if (!line.starts_with('[') || end == std::string::npos) return false;
  const std::string_view said = std::string_view(line).substr(end + 2);
  const bool is_frame = said.size() > 3 && said[0] == '[' && said[3] == ']' && said.ends_with(']');
  return is_frame || said == "*** Process received signal ***" || said == "*** End of error message ***" ||
         said.starts_with("Signal code: ") || said.starts_with("Failing at address: ");
}

// The null-terminated array of pointers that exec() expects.
std::vector<char*> Pointers(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers;
}

std::vector<std::string> EnvironmentWith(const std::vector<std::pair<std::string, std::string>>& variables) {
  std::vector<std::string> entries;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string text = *entry, name = text.substr(0, text.find('='));
    const auto has_name = [&name](const auto& variable) { return variable.first == name; };
    // Settings of this server may be secret, so child processes do not inherit them.
    if (name.starts_with("DLCSD_") || std::any_of(variables.begin(), variables.end(), has_name)) continue;
    entries.push_back(text);
  }
  for (const auto& [name, value] : variables) entries.push_back(name + "=" + value);
  return entries;
}

// Starts a program in a process group of its own, with an empty standard input, all output written to `output`, and
// none of the open files of this process.
absl::StatusOr<pid_t> Spawn(const std::string& path, std::vector<std::string> arguments,
                            std::vector<std::string> environment, int output) {
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&files, output, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files, output, STDERR_FILENO);
  posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK);
  posix_spawnattr_setpgroup(&attributes, 0);
  sigset_t all, none;
  sigfillset(&all);
  sigemptyset(&none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setsigmask(&attributes, &none);
  pid_t process = 0;
  const int error = posix_spawn(&process, path.c_str(), &files, &attributes, Pointers(arguments).data(),
                                Pointers(environment).data());
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (error == 0) return process;
  return absl::FailedPreconditionError(
      fmt::format("The launcher of this worker cannot be started: {}: {}", path, std::strerror(error)));
}

}  // namespace

absl::StatusOr<std::vector<std::string>> SplitLauncher(const std::string& launcher) {
  std::vector<std::string> words;
  bool in_word = false;
  char quote = '\0';
  for (const char c : launcher) {
    const bool is_blank = c == ' ' || c == '\t';
    if (quote == '\0' && is_blank) {
      in_word = false;
      continue;
    }
    if (!in_word) words.emplace_back();
    in_word = true;
    if (quote != '\0' ? c == quote : c == '\'' || c == '"') {
      quote = quote == '\0' ? c : '\0';
    } else {
      words.back() += c;
    }
  }
  const auto broken = [&launcher](const char* rule) {
    return absl::InvalidArgumentError(fmt::format("--mpi-launcher {}: {}", launcher, rule));
  };
  if (quote != '\0') return broken("a quote is not closed");
  const bool has_ranks = std::any_of(words.begin(), words.end(),
                                     [](const std::string& word) { return word.find(kRanks) != std::string::npos; });
  if (!has_ranks) return broken("{ranks} is missing; it stands for the number of ranks, as in mpirun -n {ranks}");
  return words;
}

absl::Status CheckRankSettings(const RankSettings& settings) {
  if (settings.launcher.empty()) return absl::OkStatus();
  const absl::StatusOr<std::vector<std::string>> words = SplitLauncher(settings.launcher);
  if (!words.ok()) return words.status();
  if (FindProgram(words->front()).empty()) {
    return absl::InvalidArgumentError(fmt::format("--mpi-launcher {}: {} is not a program in PATH; give its path",
                                                  settings.launcher, words->front()));
  }
  if (FindRankProgram(settings.program).empty()) {
    return absl::InvalidArgumentError(
        fmt::format("--mpi-program {}: is not a program, neither beside dlcsd nor in PATH; deploy/install-packages.sh "
                    "mpi and a new build make dlcs-mpi",
                    settings.program));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<RankLauncher>> RankLauncher::Start(
    const RankSettings& settings, int ranks, const std::vector<std::pair<std::string, std::string>>& variables,
    std::string name) {
  if (absl::Status sound = CheckRankSettings(settings); !sound.ok()) {
    return absl::FailedPreconditionError(
        fmt::format("This worker cannot start ranks: {}", std::string(sound.message())));
  }
  std::vector<std::string> words = *SplitLauncher(settings.launcher);
  for (std::string& word : words) {
    for (std::size_t at = word.find(kRanks); at != std::string::npos; at = word.find(kRanks)) {
      word.replace(at, sizeof kRanks - 1, std::to_string(ranks));
    }
  }
  const std::string path = FindProgram(words.front());
  for (std::string word :
       {FindRankProgram(settings.program), std::string("--ranks"), std::to_string(ranks), std::string("attend")}) {
    words.push_back(std::move(word));
  }
  std::array<int, 2> pipe{};
  if (pipe2(pipe.data(), O_CLOEXEC) != 0) {
    return absl::ResourceExhaustedError(
        fmt::format("Cannot create a pipe for the output of ranks: {}", std::strerror(errno)));
  }
  spdlog::info("{}: starting {} ranks: {}", name, ranks, fmt::join(words, " "));
  const absl::StatusOr<pid_t> process = Spawn(path, std::move(words), EnvironmentWith(variables), pipe[1]);
  close(pipe[1]);
  if (!process.ok()) {
    close(pipe[0]);
    return process.status();
  }
  fcntl(pipe[0], F_SETFL, O_NONBLOCK);
  return std::unique_ptr<RankLauncher>(new RankLauncher(*process, pipe[0], std::move(name)));
}

RankLauncher::~RankLauncher() {
  End();
  if (output_ >= 0) close(output_);
}

bool RankLauncher::Wait(milliseconds timeout) {
  const auto until = steady_clock::now() + timeout;
  while (!status_) {
    int status = 0;
    // Does not reap the process, so that its id still names its process group below.
    siginfo_t info{};
    if (waitid(P_PID, static_cast<id_t>(process_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid != 0) {
      ReadOutput();
      kill(-process_, SIGKILL);  // its remaining children
      while (waitpid(process_, &status, 0) < 0 && errno == EINTR) continue;
      ReadOutput();
      if (!line_.empty()) Log(std::exchange(line_, ""));
      status_ = status;
      break;
    }
    const milliseconds left = std::chrono::duration_cast<milliseconds>(until - steady_clock::now());
    if (left <= milliseconds(0)) break;
    const milliseconds pause = std::min(left, kLauncherPollInterval);
    pollfd readable{.fd = output_, .events = POLLIN, .revents = 0};
    if (output_ < 0) {
      std::this_thread::sleep_for(pause);
    } else if (poll(&readable, 1, static_cast<int>(pause.count())) > 0) {
      ReadOutput();
    }
  }
  return status_.has_value();
}

void RankLauncher::End() {
  if (Wait(milliseconds(0))) return;
  kill(-process_, SIGTERM);
  if (Wait(kTerminateTimeout)) return;
  kill(-process_, SIGKILL);
  while (!Wait(kTerminateTimeout)) continue;
}

void RankLauncher::ReadOutput() {
  std::array<char, 4096> bytes{};
  for (;;) {
    if (output_ < 0) return;
    const ssize_t count = read(output_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return;  // nothing more for now
    if (count == 0) {
      close(std::exchange(output_, -1));
      return;
    }
    for (ssize_t k = 0; k < count; ++k) {
      const char c = bytes[static_cast<std::size_t>(k)];
      if (c == '\n') {
        Log(std::exchange(line_, ""));
      } else if (line_.size() < kMaxLineBytes) {
        line_ += c;
      }
    }
  }
}

void RankLauncher::Log(const std::string& line) {
  const std::string text = Printable(line);
  if (text.find_first_not_of(" -") == std::string::npos) return;  // lines that only separate messages
  spdlog::info("{}: ranks: {}", name_, text);
  if (IsOfCrash(text)) return;
  last_.push_back(text);
  const auto size = [](std::size_t sum, const std::string& kept) { return sum + kept.size(); };
  while (last_.size() > 1 && std::accumulate(last_.begin(), last_.end(), std::size_t{0}, size) > kKeptBytes) {
    last_.erase(last_.begin());
  }
}

bool RankLauncher::WasKilled() const {
  constexpr int kSignals = 128;  // shells and launchers add it to the number of the signal that ended a child
  if (!status_) return false;
  return WIFSIGNALED(*status_) || (WIFEXITED(*status_) && WEXITSTATUS(*status_) > kSignals);
}

std::string RankLauncher::HowItEnded() const {
  if (!status_) return "runs";
  const std::string how = WIFSIGNALED(*status_) ? fmt::format("was ended by signal {}", WTERMSIG(*status_))
                                                : fmt::format("ended with exit code {}", WEXITSTATUS(*status_));
  return last_.empty() ? how : fmt::format("{}: {}", how, fmt::join(last_, " / "));
}

}  // namespace dlcs

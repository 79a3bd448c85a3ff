// SPDX-License-Identifier: Apache-2.0
#include "client/cli/commands/result_plot.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/commands/command_support.h"

extern char** environ;

namespace dlcs::client {
namespace {

// More curves in one panel, or points in one curve, cannot be told apart.
constexpr int kMostCurves = 12;
constexpr int kMostRows = 20'000;
constexpr int kMostSwitchingTimes = 200;

// A string of gnuplot in which nothing is substituted.
std::string Quoted(std::string_view text) {
  std::string result = "'";
  for (const char c : text) {
    if (c == '\'') result += '\'';
    if (c != '\n' && c != '\r') result += c;
  }
  return result + "'";
}

// The trajectory as a table: t, x, y, w. Where y jumps there are two rows, the left limit first.
class Table {
 public:
  explicit Table(const v1::SolveResult& result) : chunk_(result.trajectory()) {
    const int times = chunk_.times_size();
    states_ = chunk_.x_size() / times;
    pairs_ = chunk_.y_size() / times;
    has_w_ = chunk_.w_size() == chunk_.y_size();
  }

  int states() const { return states_; }
  int pairs() const { return pairs_; }
  bool has_w() const { return has_w_; }
  bool fits() const {
    const int times = chunk_.times_size();
    return chunk_.x_size() == times * states_ && chunk_.y_size() == times * pairs_;
  }

  void Print(std::ostream& out) const {
    const int stride = (chunk_.times_size() + kMostRows - 1) / kMostRows;
    auto limit = chunk_.left_limits().begin();
    for (int k = 0; k < chunk_.times_size(); ++k) {
      const bool jumps = limit != chunk_.left_limits().end() && limit->index() == chunk_.first() + k;
      if (jumps) {
        PrintRow(out, k, limit->y_size() == pairs_ ? limit->y().data() : y(k),
                 limit->w_size() == pairs_ ? limit->w().data() : w(k));
        ++limit;
      }
      if (jumps || k % stride == 0 || k + 1 == chunk_.times_size()) PrintRow(out, k, y(k), w(k));
    }
  }

 private:
  const double* y(int k) const { return chunk_.y().data() + static_cast<std::ptrdiff_t>(k) * pairs_; }
  const double* w(int k) const {
    return has_w_ ? chunk_.w().data() + static_cast<std::ptrdiff_t>(k) * pairs_ : nullptr;
  }
  void PrintRow(std::ostream& out, int k, const double* y_row, const double* w_row) const {
    out << fmt::format("{:.9g}", chunk_.times(k));
    for (int i = 0; i < states_; ++i) out << fmt::format(" {:.7g}", chunk_.x(k * states_ + i));
    for (int i = 0; i < pairs_; ++i) out << fmt::format(" {:.7g}", y_row[i]);
    for (int i = 0; i < pairs_ && w_row != nullptr; ++i) out << fmt::format(" {:.7g}", w_row[i]);
    out << '\n';
  }

  const v1::TrajectoryChunk& chunk_;
  int states_ = 0, pairs_ = 0;
  bool has_w_ = false;
};

// One panel: `count` columns from `first` on, with names or a letter and a number.
struct Panel {
  const char* letter;
  int first;
  int count;
  const google::protobuf::RepeatedPtrField<std::string>& names;
};

std::string CurveName(const Panel& panel, int i) {
  if (i < panel.names.size()) return *panel.letter == 'w' ? fmt::format("w({})", panel.names[i]) : panel.names[i];
  return fmt::format("{}{}", panel.letter, i + 1);
}

std::string ScriptFor(const v1::SolveResult& result, const Table& table, const std::string& output, bool png,
                      const std::string& data) {
  std::vector<Panel> panels = {{"x", 2, table.states(), result.analysis().state_names()}};
  const auto& pair_names = result.analysis().pair_names();
  if (table.pairs() > 0) panels.push_back({"y", 2 + table.states(), table.pairs(), pair_names});
  if (table.has_w() && table.pairs() > 0) {
    panels.push_back({"w", 2 + table.states() + table.pairs(), table.pairs(), pair_names});
  }
  const int height = 60 + 260 * static_cast<int>(panels.size());
  std::string script = fmt::format("set terminal {} size 900,{} noenhanced\nset output {}\n",
                                   png ? "pngcairo" : "svg background 'white'", height, Quoted(output));
  script += fmt::format("set multiplot layout {},1 title {}\n", panels.size(),
                        Quoted(result.title() + ": " + result.summary().verdict().text()));
  script += "set grid lc rgb '#dddddd'\nset key outside right\nset lmargin 12\nset rmargin 18\n";
  script += fmt::format("set xrange [{:.17g}:{:.17g}]\n", result.trajectory().times(0),
                        *result.trajectory().times().rbegin());
  const int switchings = std::min(result.summary().switching_times_size(), kMostSwitchingTimes);
  for (int k = 0; k < switchings; ++k) {
    script += fmt::format("set arrow from {0:.17g}, graph 0 to {0:.17g}, graph 1 nohead dt 3 lc rgb '#999999'\n",
                          result.summary().switching_times(k).time());
  }
  for (const Panel& panel : panels) {
    script += fmt::format("set ylabel '{}'\nset xlabel '{}'\nplot ", panel.letter, &panel == &panels.back() ? "t" : "");
    for (int i = 0; i < std::min(panel.count, kMostCurves); ++i) {
      script += fmt::format("{}{} using 1:{} with lines lw 1.5 title {}", i > 0 ? ", " : "", Quoted(data),
                            panel.first + i, Quoted(CurveName(panel, i)));
    }
    script += '\n';
  }
  return script + "unset multiplot\nunset output\n";
}

// A folder for the script and the data, removed at the end.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "dlcs-plot-XXXXXX").string();
    if (mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

absl::Status NoGnuplot() {
  return absl::FailedPreconditionError("plot: needs gnuplot, which is not on the PATH; on Debian: gnuplot-nox");
}

// Errors: FailedPrecondition if there is no gnuplot; Internal if it fails.
absl::Status RunGnuplot(const std::string& script) {
  std::string program = "gnuplot", argument = script;
  char* const arguments[] = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  const int failed = posix_spawnp(&child, "gnuplot", nullptr, nullptr, arguments, environ);
  if (failed == ENOENT) return NoGnuplot();
  if (failed != 0) return absl::InternalError(fmt::format("plot: gnuplot: {}", std::strerror(failed)));
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return absl::OkStatus();
  return absl::InternalError("plot: gnuplot failed; its message is above");
}

}  // namespace

absl::Status CheckPictureName(const std::string& option, const std::string& output) {
  if (output.ends_with(".png") || output.ends_with(".svg")) return absl::OkStatus();
  return absl::InvalidArgumentError(fmt::format("{} {}: must end with .svg or .png", option, output));
}

absl::Status FindGnuplot() {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (access((folder + "/gnuplot").c_str(), X_OK) == 0) return absl::OkStatus();
  }
  return NoGnuplot();
}

absl::Status DrawResult(const v1::SolveResult& result, const std::string& source, const std::string& output) {
  if (result.trajectory().times_size() < 2) {
    return absl::InvalidArgumentError(fmt::format("{}: has no trajectory to draw", source));
  }
  const Table table(result);
  if (!table.fits()) return absl::InvalidArgumentError(fmt::format("{}: x or y has missing values", source));
  const ScratchFolder folder;
  if (folder.path().empty()) return absl::InternalError(fmt::format("plot: no temporary folder: {}", strerror(errno)));
  const std::string data = folder.path() + "/data", script = folder.path() + "/script";
  const std::string partial = output + ".partial";
  {
    std::ofstream out(data);
    table.Print(out);
    std::ofstream(script) << ScriptFor(result, table, partial, output.ends_with(".png"), data);
    if (!out.flush()) return absl::InternalError("plot: the temporary folder is full");
  }
  absl::Status status = RunGnuplot(script);
  std::error_code error;
  if (status.ok()) std::filesystem::rename(partial, output, error);
  if (error) status = absl::InvalidArgumentError(fmt::format("{}: {}", output, error.message()));
  if (!status.ok()) std::filesystem::remove(partial, error);
  const int most = std::max(table.states(), table.pairs());
  if (status.ok() && most > kMostCurves) {
    PrintNotice(fmt::format("the picture has the first {} of {} curves of a panel", kMostCurves, most));
  }
  return status;
}

absl::Status DrawResult(const std::string& title, const SolveResult& result, const std::string& output) {
  v1::SolveResult document;
  document.set_title(title);
  *document.mutable_analysis() = result.analysis;
  *document.mutable_summary() = result.summary;
  v1::TrajectoryChunk& trajectory = *document.mutable_trajectory();
  trajectory.mutable_times()->Add(result.times.begin(), result.times.end());
  trajectory.mutable_x()->Add(result.x.begin(), result.x.end());
  trajectory.mutable_y()->Add(result.y.begin(), result.y.end());
  trajectory.mutable_w()->Add(result.w.begin(), result.w.end());
  trajectory.mutable_left_limits()->Add(result.left_limits.begin(), result.left_limits.end());
  return DrawResult(document, title, output);
}

}  // namespace dlcs::client

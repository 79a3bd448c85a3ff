// SPDX-License-Identifier: Apache-2.0
#include "client/cli/commands/result_plot.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <numeric>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/cli/commands/command_support.h"
#include "client/cli/output/atomic_file.h"
#include "proto/shared/nearest_name.h"
#include "proto/shared/truncate_text.h"

extern char** environ;

namespace dlcs::client {
namespace {

// More curves in one panel, or points in one curve, cannot be distinguished.
constexpr std::size_t kMaxCurves = 12;
constexpr int kMaxRows = 20'000;
constexpr int kMaxSwitchingTimes = 200;

// A string of gnuplot in which nothing is substituted.
std::string Quoted(std::string_view text) {
  std::string result = "'";
  for (const char c : text) {
    if (c == '\'') result += '\'';
    if (c != '\n' && c != '\r') result += c;
  }
  return result + "'";
}

// The letter of the outputs, beside x, y and w.
constexpr char kOutputs = 'z';

// One time with its x, y, w and outputs, which the result owns.
struct Row {
  double t;
  const double *x, *y, *w, *z;

  double value(char letter, int i) const { return (letter == 'x' ? x : letter == 'y' ? y : letter == 'w' ? w : z)[i]; }
};

// The trajectory of a result, which it must outlive.
class Trajectory {
 public:
  explicit Trajectory(const v1::SolveResult& result) : chunk_(result.trajectory()) {
    const int times = chunk_.times_size();
    states_ = chunk_.x_size() / times;
    pairs_ = chunk_.y_size() / times;
    outputs_ = chunk_.outputs_size() / times;
    has_w_ = chunk_.w_size() == chunk_.y_size();
  }

  int states() const { return states_; }
  int pairs() const { return pairs_; }
  int outputs() const { return outputs_; }
  bool has_w() const { return has_w_; }
  bool fits() const {
    const int times = chunk_.times_size();
    return chunk_.x_size() == times * states_ && chunk_.y_size() == times * pairs_ &&
           chunk_.outputs_size() == times * outputs_;
  }

  // For curves over time. Where y jumps there are two rows, the left limit first.
  std::vector<Row> RowsWithLimits() const {
    std::vector<Row> rows;
    const int stride = (chunk_.times_size() + kMaxRows - 1) / kMaxRows;
    auto limit = chunk_.left_limits().begin();
    for (int k = 0; k < chunk_.times_size(); ++k) {
      const Row row = row_at(k);
      const bool jumps = limit != chunk_.left_limits().end() && limit->index() == chunk_.first() + k;
      if (jumps) {
        rows.push_back({row.t, row.x, limit->y_size() == pairs_ ? limit->y().data() : row.y,
                        has_w_ && limit->w_size() == pairs_ ? limit->w().data() : row.w,
                        limit->outputs_size() == outputs_ ? limit->outputs().data() : row.z});
        ++limit;
      }
      if (jumps || k % stride == 0 || k + 1 == chunk_.times_size()) rows.push_back(row);
    }
    return rows;
  }

  // At most kMaxCurves of the times, the first and the last among them, evenly chosen.
  std::vector<Row> FewRows() const {
    const auto times = static_cast<std::size_t>(chunk_.times_size()), count = std::min(times, kMaxCurves);
    std::vector<Row> rows;
    for (std::size_t k = 0; k < count; ++k) rows.push_back(row_at(static_cast<int>(k * (times - 1) / (count - 1))));
    return rows;
  }

 private:
  Row row_at(int k) const {
    const std::ptrdiff_t before = k;
    const double* const y = chunk_.y().data() + before * pairs_;
    return {chunk_.times(k), chunk_.x().data() + before * states_, y,
            has_w_ ? chunk_.w().data() + before * pairs_ : nullptr, chunk_.outputs().data() + before * outputs_};
  }

  const v1::TrajectoryChunk& chunk_;
  int states_ = 0, pairs_ = 0, outputs_ = 0;
  bool has_w_ = false;
};

// Components of x, y or w, with the names of states or pairs if they have any; or outputs.
struct Panel {
  char letter;
  const google::protobuf::RepeatedPtrField<std::string>& names;
  std::vector<int> components;
};

std::string NumberedName(const Panel& panel, int i) { return fmt::format("{}{}", panel.letter, i + 1); }

// As in the header of a CSV file.
std::string NameOf(const Panel& panel, int i) {
  if (i >= panel.names.size()) return NumberedName(panel, i);
  return panel.letter == 'w' ? fmt::format("w({})", panel.names[i]) : panel.names[i];
}

std::string LabelOf(const Panel& panel) { return panel.letter == kOutputs ? "outputs" : std::string(1, panel.letter); }

Panel WholePanel(char letter, const google::protobuf::RepeatedPtrField<std::string>& names, int size) {
  Panel panel{letter, names, std::vector<int>(static_cast<std::size_t>(size))};
  std::iota(panel.components.begin(), panel.components.end(), 0);
  return panel;
}

std::vector<Panel> AllPanels(const v1::SolveResult& result, const Trajectory& trajectory) {
  const auto &states = result.analysis().state_names(), &pairs = result.analysis().pair_names();
  std::vector<Panel> panels;
  if (trajectory.outputs() > 0) {
    panels.push_back(WholePanel(kOutputs, result.analysis().output_names(), trajectory.outputs()));
  }
  panels.push_back(WholePanel('x', states, trajectory.states()));
  if (trajectory.pairs() == 0) return panels;
  panels.push_back(WholePanel('y', pairs, trajectory.pairs()));
  if (trajectory.has_w()) panels.push_back(WholePanel('w', pairs, trajectory.pairs()));
  return panels;
}

// `parts` of a list that was cut at every comma, also at those inside of names: v(a,b).
std::vector<std::string> WithClosedParentheses(const std::vector<std::string>& parts) {
  std::vector<std::string> names;
  bool is_open = false;
  for (const std::string& part : parts) {
    if (is_open) {
      names.back() += "," + part;
    } else {
      names.push_back(part);
    }
    is_open = std::ranges::count(names.back(), '(') > std::ranges::count(names.back(), ')');
  }
  return names;
}

// The panels with the components that `show` names: "x" is all of x. Errors: InvalidArgument with the name.
absl::StatusOr<std::vector<Panel>> ChosenPanels(const std::vector<Panel>& all, const std::vector<std::string>& show) {
  constexpr std::size_t kMaxListed = 12;
  if (show.empty() && all.front().letter == kOutputs) return std::vector<Panel>{all.front()};
  if (show.empty()) return all;
  std::vector<std::vector<int>> chosen(all.size());
  std::vector<std::string> known;
  for (const std::string& name : WithClosedParentheses(show)) {
    known.clear();
    bool found = false;
    for (std::size_t k = 0; k < all.size(); ++k) {
      for (const int i : all[k].components) {
        const std::string own = NameOf(all[k], i);
        const bool numbered = name == NumberedName(all[k], i) || name == std::string(1, all[k].letter);
        if (name == own || (numbered && all[k].letter != kOutputs)) {
          found = true;
          chosen[k].push_back(i);
        }
        known.push_back(own);
      }
    }
    if (!found) {
      return absl::InvalidArgumentError(fmt::format(
          "--show: \"{}\" is not a component of the result, which has {}; x, y and w alone mean all of them{}", name,
          JoinFirst(known, kMaxListed), DidYouMean(NearestName(name, known))));
    }
  }
  std::vector<Panel> panels;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (!chosen[k].empty()) panels.push_back({all[k].letter, all[k].names, chosen[k]});
  }
  return panels;
}

// The range of the vertical axis. gnuplot would warn of one that is empty, and leave room below y and w that are
// negative by rounding; a range that begins at 0 would cut those out.
std::string YRange(const Panel& panel, const std::vector<Row>& rows) {
  double least = std::numeric_limits<double>::infinity(), most = -least;
  for (const Row& row : rows) {
    for (const int i : panel.components) {
      least = std::min(least, row.value(panel.letter, i));
      most = std::max(most, row.value(panel.letter, i));
    }
  }
  constexpr double kRounding = 1e-9;
  if ((panel.letter == 'y' || panel.letter == 'w') && most > 0 && least > -kRounding * most) {
    return fmt::format("[{:.17g}:*]", -kRounding * most);
  }
  if (least < most) return "[*:*]";
  const double margin = least == 0 ? 1 : std::abs(least) / 10;
  return fmt::format("[{:.17g}:{:.17g}]", least - margin, least + margin);
}

// A table for gnuplot and the commands that draw it.
struct Drawing {
  std::string data, commands;
  std::vector<std::string> legend;  // of all panels
  std::size_t curves = 0;           // in the fullest panel
};

// The components over time.
Drawing OverTime(const v1::SolveResult& result, const std::vector<Panel>& panels, const std::vector<Row>& rows,
                 const std::string& file) {
  Drawing drawing;
  drawing.commands = fmt::format("set xrange [{:.17g}:{:.17g}]\n", rows.front().t, rows.back().t);
  const int switchings = std::min(result.summary().switching_times_size(), kMaxSwitchingTimes);
  for (int k = 0; k < switchings; ++k) {
    drawing.commands +=
        fmt::format("set arrow from {0:.17g}, graph 0 to {0:.17g}, graph 1 nohead dt 3 lc rgb '#999999'\n",
                    result.summary().switching_times(k).time());
  }
  int column = 1;  // of the table, after the column of t
  for (const Panel& panel : panels) {
    std::vector<std::string> curves;
    drawing.curves = std::max(drawing.curves, panel.components.size());
    for (const int i : panel.components) {
      drawing.legend.push_back(NameOf(panel, i));
      curves.push_back(fmt::format("{} using 1:{} with lines lw 1.5 title {}", Quoted(file), ++column,
                                   Quoted(drawing.legend.back())));
    }
    drawing.commands += fmt::format("set yrange {}\nset ylabel '{}'\nset xlabel '{}'\nplot {}\n", YRange(panel, rows),
                                    LabelOf(panel), &panel == &panels.back() ? "t" : "", fmt::join(curves, ", "));
  }
  for (const Row& row : rows) {
    drawing.data += fmt::format("{:.9g}", row.t);
    for (const Panel& panel : panels) {
      for (const int i : panel.components) drawing.data += fmt::format(" {:.7g}", row.value(panel.letter, i));
    }
    drawing.data += '\n';
  }
  return drawing;
}

// Each panel over its components, a curve for each time.
Drawing Profiles(const std::vector<Panel>& panels, const std::vector<Row>& rows, const std::string& file) {
  constexpr std::size_t kMaxTicks = 9, kMaxPoints = 20;  // of curves that show their points
  Drawing drawing;
  drawing.curves = rows.size();
  for (const Row& row : rows) drawing.legend.push_back(fmt::format("t = {:.6g}", row.t));
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const Panel& panel = panels[p];
    const std::size_t size = panel.components.size();
    std::vector<std::string> ticks, curves;
    for (std::size_t k = 0; k < size; k += 1 + (size - 1) / kMaxTicks) {
      ticks.push_back(fmt::format("{} {}", Quoted(NameOf(panel, panel.components[k])), k + 1));
    }
    for (std::size_t k = 0; k < rows.size(); ++k) {
      curves.push_back(fmt::format("{} index {} using 1:{} with {} lw 1.5 title {}", Quoted(file), p, k + 2,
                                   size <= kMaxPoints ? "linespoints pt 7 ps 0.4" : "lines",
                                   Quoted(drawing.legend[k])));
    }
    drawing.commands += fmt::format("set xrange [1:{}]\nset xtics ({})\nset yrange {}\nset ylabel '{}'\nplot {}\n",
                                    std::max<std::size_t>(size, 2), fmt::join(ticks, ", "), YRange(panel, rows),
                                    LabelOf(panel), fmt::join(curves, ", "));
    for (std::size_t k = 0; k < size; ++k) {
      drawing.data += std::to_string(k + 1);
      for (const Row& row : rows) drawing.data += fmt::format(" {:.7g}", row.value(panel.letter, panel.components[k]));
      drawing.data += '\n';
    }
    drawing.data += "\n\n";  // which end what gnuplot calls an index
  }
  return drawing;
}

std::string Script(const Drawing& drawing, std::size_t panels, const std::string& title, const std::string& output,
                   bool png) {
  constexpr std::size_t kMinLetters = 4, kMaxLetters = 30;   // of the legend
  constexpr std::size_t kMinHeight = 190, kLineHeight = 18;  // of a panel, and of a line of its legend
  std::size_t letters = kMinLetters;
  for (const std::string& name : drawing.legend) letters = std::max(letters, name.size());
  const std::size_t height = std::max(kMinHeight, 60 + kLineHeight * drawing.curves);
  return fmt::format(
      "set terminal {} size 900,{} noenhanced\nset output {}\nset multiplot layout {},1 title {}\n"
      "set grid ytics lt 1 lw 0.5 lc rgb '#dddddd'\nset key at graph 1.01, 1 left top Left reverse samplen 2\n"
      "set lmargin 11\nset rmargin {}\n{}unset multiplot\nunset output\n",
      png ? "pngcairo" : "svg background 'white'", 60 + height * panels, Quoted(output), panels, Quoted(title),
      6 + std::min(letters, kMaxLetters), drawing.commands);
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

// gnuplot does not notice when the disk is full, so it draws in the temporary folder.
absl::Status CopyPicture(const std::string& from, const std::string& to) {
  std::ifstream in(from, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const std::string_view end = std::string_view(bytes).substr(bytes.size() - std::min<std::size_t>(bytes.size(), 16));
  if (end.find("</svg>") == std::string_view::npos && end.find("IEND") == std::string_view::npos) {
    return absl::InternalError("plot: the temporary folder is full");
  }
  auto file = AtomicFile::Create(to);
  if (!file.ok()) return file.status();
  std::fwrite(bytes.data(), 1, bytes.size(), (*file)->stream());
  return (*file)->Commit();
}

}  // namespace

absl::Status CheckPictureName(const std::string& option, const std::string& output) {
  if (!output.ends_with(".png") && !output.ends_with(".svg")) {
    return absl::InvalidArgumentError(fmt::format("{} {}: must end with .svg or .png", option, output));
  }
  const std::filesystem::path folder = std::filesystem::path(output).parent_path();
  std::error_code ignored;
  if (folder.empty() || std::filesystem::is_directory(folder, ignored)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      fmt::format("{} {}: there is no folder {}; make it, or choose another place", option, output, folder.string()));
}

absl::Status FindGnuplot() {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (access((folder + "/gnuplot").c_str(), X_OK) == 0) return absl::OkStatus();
  }
  return NoGnuplot();
}

absl::Status DrawResult(const v1::SolveResult& result, const PictureOptions& options, const std::string& source,
                        const std::string& output) {
  if (result.trajectory().times_size() < 2) {
    return absl::InvalidArgumentError(fmt::format("{}: has no trajectory to draw", source));
  }
  const Trajectory trajectory(result);
  if (!trajectory.fits()) return absl::InvalidArgumentError(fmt::format("{}: x or y has missing values", source));
  absl::StatusOr<std::vector<Panel>> panels = ChosenPanels(AllPanels(result, trajectory), options.show);
  if (!panels.ok()) return panels.status();
  std::size_t most = 0;
  for (Panel& panel : *panels) {
    most = std::max(most, panel.components.size());
    if (!options.profile) panel.components.resize(std::min(panel.components.size(), kMaxCurves));
  }
  const ScratchFolder folder;
  if (folder.path().empty()) return absl::InternalError(fmt::format("plot: no temporary folder: {}", strerror(errno)));
  const std::string data = folder.path() + "/data", script = folder.path() + "/script";
  const std::string picture = folder.path() + "/picture";
  const Drawing drawing = options.profile ? Profiles(*panels, trajectory.FewRows(), data)
                                          : OverTime(result, *panels, trajectory.RowsWithLimits(), data);
  {
    std::ofstream out(data);
    out << drawing.data;
    std::ofstream(script) << Script(drawing, panels->size(), result.title() + ": " + result.summary().verdict().text(),
                                    picture, output.ends_with(".png"));
    if (!out.flush()) return absl::InternalError("plot: the temporary folder is full");
  }
  absl::Status status = RunGnuplot(script);
  if (status.ok()) status = CopyPicture(picture, output);
  const auto curves = options.profile ? static_cast<std::size_t>(result.trajectory().times_size()) : most;
  if (status.ok() && curves > kMaxCurves) {
    PrintNotice(options.profile
                    ? fmt::format("the picture has {} of the {} times of the result", kMaxCurves, curves)
                    : fmt::format("the picture has the first {} of {} curves of a panel; --show chooses others",
                                  kMaxCurves, curves));
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
  trajectory.mutable_outputs()->Add(result.outputs.begin(), result.outputs.end());
  *document.mutable_analysis()->mutable_output_names() = {result.names.outputs.begin(), result.names.outputs.end()};
  trajectory.mutable_left_limits()->Add(result.left_limits.begin(), result.left_limits.end());
  return DrawResult(document, {}, title, output);
}

}  // namespace dlcs::client

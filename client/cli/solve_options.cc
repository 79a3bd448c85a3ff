// SPDX-License-Identifier: Apache-2.0
#include "client/cli/solve_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/commands/array_output.h"
#include "client/cli/options/option_kinds.h"
#include "client/cli/options/solve_option_table.h"
#include "client/cli/output/atomic_file.h"
#include "client/result/names.h"

namespace dlcs::client {
void AddProblem(CLI::App& app, std::string& path) {
  app.add_option("PROBLEM", path, "Problem file, JSON, .npz or .mat, or SPICE deck; - reads standard input")
      ->required()
      ->type_name("FILE");
}

void AddRule(CLI::App& app, std::optional<v1::SolutionRule>& rule) {
  AddWord<v1::SolutionRule>(
      app, "--rule", Words<v1::SolutionRule>(), ParseWord<v1::SolutionRule>,
      [&rule](v1::SolutionRule value) { rule = value; },
      "Which solution of the LCP to take if there are several; overrides the file");
}

void AddOutput(CLI::App& app, std::string& output, const char* what) {
  app.add_option(
         "-o,--output", output,
         fmt::format("Write {} to this file, completely or not at all, instead of printing it; - prints it", what))
      ->type_name("FILE");
}

void AddQuiet(CLI::App& app, bool& quiet, const char* what) { app.add_flag("-q,--quiet", quiet, what); }

void AddFormat(CLI::App& app, const std::vector<std::string>& words, OutputFormat& format, const std::string& help) {
  const auto parse = [words](const std::string& text) -> std::optional<OutputFormat> {
    if (std::find(words.begin(), words.end(), text) == words.end()) return std::nullopt;
    if (text == "json") return OutputFormat::kJson;
    if (text == "name") return OutputFormat::kName;
    if (text == "npy") return OutputFormat::kNpy;
    if (text == "npz") return OutputFormat::kNpz;
    if (text == "hdf5") return OutputFormat::kHdf5;
    if (text == "mat") return OutputFormat::kMat;
    if (text == "raw") return OutputFormat::kRaw;
    return text == "csv" ? OutputFormat::kCsv : OutputFormat::kTable;
  };
  AddWord<OutputFormat>(
      app, std::find(words.begin(), words.end(), "name") == words.end() ? "-f,--format" : "-o,-f,--format", words,
      parse, [&format](OutputFormat value) { format = value; }, help);
}

namespace {

// What is wrong with the ending of a file that would hold a table: that of pictures, or of programs that would not read
// it. Empty if nothing is.
std::string FaultOfEnding(const std::string& output) {
  std::string ending = std::filesystem::path(output).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const char* picture : {".svg", ".png", ".pdf", ".gif", ".jpg", ".jpeg", ".eps"}) {
    if (ending != picture) continue;
    return fmt::format("{} would be a table; pictures are drawn by --plot FILE.svg of dlcs solve and by dlcs plot",
                       output);
  }
  for (const char* other : {".xls", ".xlsx", ".ods", ".tsv", ".hdf", ".nc", ".parquet", ".feather", ".pkl", ".m",
                            ".yaml", ".yml", ".xml"}) {
    if (ending != other) continue;
    return fmt::format(
        "{} would be a table, and {} is the ending of another format; name a file that ends with .csv or "
        ".json, for example, or say --format table",
        output, ending);
  }
  return "";
}

}  // namespace

void AddFormatAndOutput(CLI::App& app, const std::vector<std::string>& words, OutputFormat& format,
                        const std::string& help, std::string& output, const char* what) {
  AddFormat(app, words, format, help);
  AddOutput(app, output, what);
  app.callback([&app, &format, &output, words] {
    const CLI::Option& given = *app.get_option("--format");
    const auto named = FormatByEnding(output);
    if (given.count() == 0 && named) {
      format = named->format;
      if (std::find(words.begin(), words.end(), named->word) == words.end()) {
        throw CLI::ValidationError("--output", fmt::format("{} would be {}, which this command does not write; name "
                                                           "another file, or one of {} with --format",
                                                           output, named->word, fmt::join(words, ", ")));
      }
    }
    if (given.count() == 0 && !named) {
      if (const std::string fault = FaultOfEnding(output); !fault.empty()) {
        throw CLI::ValidationError("--output", fault);
      }
    }
    if (IsOfArrays(format) && IsStandardOutput(output)) {
      throw CLI::ValidationError(
          "--format", fmt::format("{} is not text; name a file for it with --output", given.results().front()));
    }
  });
}

void AddHowToSolve(CLI::App& app, v1::SolveOptions& options, std::string& nodes_as_typed,
                   std::optional<v1::SolutionRule>& rule) {
  for (const SolveOption& row : SolveOptionTable()) {
    CLI::Option* option = AddSolveOption(app, row, options, nodes_as_typed);
    for (const std::string_view other : row.excludes) {
      if (!other.empty()) option->excludes(app.get_option(std::string(other)));
    }
  }
  AddRule(app, rule);
}

}  // namespace dlcs::client

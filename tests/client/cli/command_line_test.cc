// SPDX-License-Identifier: Apache-2.0
#include "client/cli/command_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <variant>
#include <vector>

#include "client/netlist/netlist.h"
#include "tests/support/paths.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

struct Outcome {
  ParsedCommandLine parsed;
  std::string out;
  std::string err;
};

Outcome Parse(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "dlcs");
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  Outcome outcome{ParseCommandLine(static_cast<int>(arguments.size()), arguments.data()), "", ""};
  outcome.out = ::testing::internal::GetCapturedStdout();
  outcome.err = ::testing::internal::GetCapturedStderr();
  return outcome;
}

SolveCommand Solve(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), {"solve", "p.json"});
  const Outcome outcome = Parse(arguments);
  const auto* command = std::get_if<SolveCommand>(&outcome.parsed);
  EXPECT_NE(command, nullptr) << outcome.err;
  return command == nullptr ? SolveCommand{} : *command;
}

// The error of a refused command line. Checks the exit code.
std::string Refused(const std::vector<const char*>& arguments) {
  const Outcome outcome = Parse(arguments);
  const auto* code = std::get_if<ExitCode>(&outcome.parsed);
  EXPECT_NE(code, nullptr);
  if (code != nullptr) {
    EXPECT_EQ(*code, kBadInput);
  }
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr("--help"));
  return outcome.err;
}

TEST(CommandLineTest, TakesAPeriod) {
  EXPECT_EQ(Solve({"--periodic", "2e-5"}).options.period(), 2e-5);
  EXPECT_EQ(Solve({"--periodic", "auto"}).options.period(), -1);
  for (const char* text : {"-1", "0", "nan", "Auto", ""}) {
    EXPECT_THAT(Refused({"solve", "p.json", "--periodic", text}), HasSubstr("auto or a number above 0")) << text;
  }
}

TEST(CommandLineTest, TakesPropagatorAccelerationAndMemory) {
  const v1::SolveOptions options = Solve({"--propagator", "sparse-stepping", "--acceleration", "4",
                                          "--windows-in-flight", "3", "--max-memory", "1.5GB"})
                                       .options;
  EXPECT_EQ(options.propagator(), v1::PROPAGATOR_KIND_SPARSE_STEPPING);
  EXPECT_EQ(options.acceleration(), 4);
  EXPECT_EQ(options.windows_in_flight(), 3);
  EXPECT_EQ(options.max_memory_bytes(), 1.5e9);
  EXPECT_EQ(Solve({"--max-memory", "2000"}).options.max_memory_bytes(), 2000);
  EXPECT_EQ(Solve({"--max-memory", "3kb"}).options.max_memory_bytes(), 3000);
  EXPECT_GT(Solve({"--max-memory", "1e30GB"}).options.max_memory_bytes(), 4e18);
  for (const char* text : {"8GX", "5XB", "3kiB", "2b"}) {
    EXPECT_THAT(Refused({"solve", "p.json", "--max-memory", text}),
                HasSubstr("unknown unit, " + std::string(text + 1) + "; must be in bytes, kB, MB, GB or TB"));
  }
  for (const char* text : {"", "GB", "nan", "0MB"}) {
    EXPECT_THAT(Refused({"solve", "p.json", "--max-memory", text}), HasSubstr("above 0, in bytes, kB, MB, GB or TB"));
  }
  EXPECT_THAT(Refused({"solve", "p.json", "--max-memory", "-1GB"}), HasSubstr("above 0"));
  EXPECT_THAT(Refused({"solve", "p.json", "--acceleration", "21"}), HasSubstr("between 0 and 20"));
  EXPECT_THAT(Refused({"solve", "p.json", "--windows-in-flight", "0"}), HasSubstr("between 1 and 64"));
  EXPECT_THAT(Refused({"solve", "p.json", "--propagator", "kroneker"}), HasSubstr("did you mean kronecker-sum?"));
}

TEST(CommandLineTest, LeavesUnsetWhatWasNotGiven) {
  const SolveCommand command = Solve({});
  EXPECT_EQ(command.problem_path, "p.json");
  EXPECT_EQ(command.options.SerializeAsString(), "");
  EXPECT_FALSE(command.rule);
  EXPECT_EQ(command.format, OutputFormat::kTable);
  EXPECT_GT(command.deadline_s, 0);
}

TEST(CommandLineTest, PutsEveryOptionInItsField) {
  const SolveCommand command = Solve({"--server",
                                      "h:1",
                                      "--method",
                                      "wu-chen-iteration",
                                      "--step",
                                      "1e-3",
                                      "--theta",
                                      "0.5",
                                      "--step-solver",
                                      "newton",
                                      "--average-y",
                                      "--kernel",
                                      "phi-functions",
                                      "--interpolation",
                                      "cubic-spline",
                                      "--contour",
                                      "remark-2-4",
                                      "--rule",
                                      "least-element",
                                      "--project-initial-state",
                                      "--estimate-error",
                                      "--threads",
                                      "3",
                                      "--format",
                                      "csv",
                                      "--output",
                                      "o.csv",
                                      "--quiet",
                                      "--window",
                                      "whole",
                                      "--iteration-tolerance",
                                      "1e-9",
                                      "--max-iterations",
                                      "70",
                                      "--contour-nodes",
                                      "12",
                                      "--contour-gamma",
                                      "0.7",
                                      "--contour-mu",
                                      "2",
                                      "--contour-step",
                                      "0.25",
                                      "--contour-initial-state",
                                      "--deadline",
                                      "2.5"});
  EXPECT_EQ(command.server.address, "h:1");
  const v1::SolveOptions& options = command.options;
  EXPECT_EQ(options.method(), v1::METHOD_WU_CHEN_ITERATION);
  EXPECT_EQ(options.grid_case(), v1::SolveOptions::kStep);
  EXPECT_EQ(options.step(), 1e-3);
  EXPECT_EQ(options.theta(), 0.5);
  EXPECT_EQ(options.step_solver(), v1::STEP_SOLVER_NEWTON);
  EXPECT_TRUE(options.average_y());
  EXPECT_EQ(options.kernel(), v1::KERNEL_SOURCE_PHI_FUNCTIONS);
  EXPECT_EQ(options.interpolation(), v1::INTERPOLATION_CUBIC_SPLINE);
  EXPECT_EQ(options.contour().choice(), v1::CONTOUR_CHOICE_REMARK_2_4);
  EXPECT_EQ(command.rule, v1::SOLUTION_RULE_LEAST_ELEMENT);
  EXPECT_TRUE(options.project_initial_state());
  EXPECT_TRUE(options.estimate_error());
  EXPECT_EQ(options.threads(), 3);
  EXPECT_EQ(command.format, OutputFormat::kCsv);
  EXPECT_EQ(command.output, "o.csv");
  EXPECT_TRUE(command.quiet);
  EXPECT_EQ(options.window_steps(), -1);
  EXPECT_EQ(options.iteration_tolerance(), 1e-9);
  EXPECT_EQ(options.max_iterations(), 70);
  EXPECT_EQ(options.contour().nodes(), 12);
  EXPECT_EQ(options.contour().gamma(), 0.7);
  EXPECT_EQ(options.contour().mu(), 2);
  EXPECT_EQ(options.contour().step(), 0.25);
  EXPECT_TRUE(options.contour().for_initial_state());
  EXPECT_EQ(command.deadline_s, 2.5);
}

TEST(CommandLineTest, CountsStepsInAnyNotation) {
  EXPECT_EQ(Solve({"--steps", "1e6"}).options.steps(), 1000000);
  EXPECT_EQ(Solve({"--steps=128000"}).options.steps(), 128000);
  EXPECT_EQ(Solve({"--window", "16"}).options.window_steps(), 16);
  EXPECT_EQ(Solve({"--window", "auto"}).options.window_steps(), 0);
}

TEST(CommandLineTest, SortsOutputTimes) {
  EXPECT_THAT(Solve({"--at", "1, 0.25,0.5,1"}).options.output_times(), ElementsAre(0.25, 0.5, 1));
  EXPECT_THAT(Solve({"--at", "0:0.1:0.5, 7"}).options.output_times(), ElementsAre(0, 0.1, 0.2, 0.3, 0.4, 0.5, 7));
  EXPECT_THAT(Solve({"--at", "1:0.4:2"}).options.output_times(), ElementsAre(1, 1.4, 1.8));
  EXPECT_THAT(Solve({"--at", "3:1:3"}).options.output_times(), ElementsAre(3));
}

TEST(CommandLineTest, TakesTheNodesFromTheLineOrFromAFile) {
  const SolveCommand typed = Solve({"--grid", "1, 0.25,5e-1"});
  EXPECT_THAT(typed.options.grid_times().times(), ElementsAre(0.25, 0.5, 1));
  EXPECT_EQ(typed.grid, "1, 0.25,5e-1");
  const std::string path = ::testing::TempDir() + "dlcs-grid-test.txt";
  std::ofstream(path) << "0.25\n0.5, 1e-3\n\n2\n";
  EXPECT_THAT(Solve({"--grid", path.c_str()}).options.grid_times().times(), ElementsAre(0.001, 0.25, 0.5, 2));
  std::ofstream(path) << "0.25\nhalf\n";
  EXPECT_THAT(Refused({"solve", "p.json", "--grid", path.c_str()}), AllOf(HasSubstr(path), HasSubstr("\"half\"")));
  std::ofstream(path) << "\n";
  EXPECT_THAT(Refused({"solve", "p.json", "--grid", path.c_str()}), HasSubstr("is not a time"));
  std::filesystem::remove(path);
  EXPECT_THAT(Refused({"solve", "p.json", "--grid", path.c_str()}), HasSubstr(path));
  EXPECT_THAT(Refused({"solve", "p.json", "--grid", "-1,2"}), HasSubstr("\"-1\" is not a time"));
  EXPECT_THAT(Refused({"solve", "p.json", "--grid", "1", "--steps", "3"}), HasSubstr("--grid"));
}

TEST(CommandLineTest, NumbersMayHaveTheSuffixesOfSpice) {
  const auto times = [](const char* text) {
    const SolveCommand command = Solve({"--at", text});
    const auto& found = command.options.output_times();
    return std::vector<double>(found.begin(), found.end());
  };
  EXPECT_EQ(times("1m,20u,1n,2p,3f,0.1u"), (std::vector<double>{3e-15, 2e-12, 1e-9, 0.1e-6, 20e-6, 1e-3}));
  EXPECT_EQ(times("10k,1meg,2MEG,3g,4T,1e-3K"), (std::vector<double>{1, 1e4, 1e6, 2e6, 3e9, 4e12}));
  EXPECT_EQ(times("1\u00b5"), std::vector<double>{1e-6});
  EXPECT_EQ(times("0:1m:20m"), times("0:0.001:0.02"));
  EXPECT_EQ(times("0:20m:20m").back(), 0.02);
  EXPECT_EQ(Solve({"--step", "20u"}).options.step(), 20e-6);
  EXPECT_EQ(Solve({"--periodic", "10u"}).options.period(), 10e-6);
  EXPECT_EQ(Solve({"--tolerance", "1u"}).options.error_tolerance(), 1e-6);
  EXPECT_THAT(Solve({"--grid", "1m,20m"}).options.grid_times().times(), ElementsAre(0.001, 0.02));
  EXPECT_THAT(Solve({"--grid", "1m"}).options.grid_times().times(), ElementsAre(0.001));
}

TEST(CommandLineTest, SaysWhichSuffixesThereAre) {
  const auto refused = [](const char* option, const char* text) { return Refused({"solve", "p.json", option, text}); };
  EXPECT_THAT(refused("--at", "1x"),
              HasSubstr("\"1x\" is not a time: a number of at least 0; suffixes are t, g, meg, "));
  EXPECT_THAT(refused("--at", "1ms"),
              HasSubstr("\"1ms\" is not a time: a number of at least 0; write 1m, without a unit"));
  EXPECT_THAT(refused("--at", "5s"), HasSubstr("; write 5, without a unit"));
  EXPECT_THAT(refused("--step", "1M"), HasSubstr("; M is milli in SPICE and mega elsewhere: write 1m or 1meg"));
  EXPECT_THAT(refused("--step", "-1m"), HasSubstr("\"-1m\" is not a number above 0\n"));
  EXPECT_THAT(refused("--step", "4k7"), HasSubstr("\"4k7\" is not a number above 0\n"));
  EXPECT_THAT(refused("--step", "m"), HasSubstr("\"m\" is not a number above 0\n"));
  EXPECT_THAT(refused("--step", "1e400k"), HasSubstr("\"1e400k\" is not a number above 0\n"));
  EXPECT_THAT(refused("--at", "0:1m"), HasSubstr("\"\" is not the end of a range"));
  // Whole numbers have none, and neither have seconds that people wait: 5m are minutes to most.
  EXPECT_THAT(refused("--steps", "10k"), HasSubstr("\"10k\" is not "));
  EXPECT_THAT(refused("--deadline", "5m"), HasSubstr("\"5m\" is not a number of seconds above 0\n"));
  EXPECT_THAT(Refused({"get", "1", "--patience", "5m"}), HasSubstr("\"5m\" is not a number of at least 0\n"));
  EXPECT_THAT(Refused({"submit", "p.json", "--priority", "0.5"}), HasSubstr("\"0.5\" is not a whole number"));
}

// Each element and command that decks may hold stands in the help of netlist, and nothing else does.
TEST(CommandLineTest, HelpOfNetlistNamesWhatDecksMayHold) {
  const std::string help = Parse({"netlist", "--help"}).out;
  const std::string reads =
      help.substr(help.find("Reads R, L"), help.find("What is not supported") - help.find("Reads R, L"));
  for (char letter = 'A'; letter <= 'Z'; ++letter) {
    const std::string deck = std::string("title\n") + letter + "1 a 0 1\n.tran 1u 1m\n.end\n";
    const auto netlist = ReadNetlist(deck, "d.cir", "", {});
    const std::string message(netlist.status().message());
    const auto has = [&message](const char* part) { return message.find(part) != std::string::npos; };
    const bool is_known = !has("is not known") && !has("not supported") && !has("only MOSFETs (M) are read");
    const bool is_named = std::regex_search(reads, std::regex(std::string("\\b") + letter + "\\b"));
    EXPECT_EQ(is_known, is_named) << letter << ": " << message;
  }
  for (const char* command :
       {".param a=1", ".func f(x) {x}", ".model m d", ".subckt s a\n.ends", ".global a", ".include x", ".lib x",
        ".ic v(a)=0", ".print v(a)", ".plot v(a)", ".probe v(a)", ".save v(a)", ".meas tran x avg v(a)"}) {
    const std::string word = std::string(command).substr(0, std::string(command).find(' '));
    EXPECT_THAT(reads, HasSubstr(word));
    const auto netlist =
        ReadNetlist("title\nR1 a 0 1\nC1 a 0 1\n.tran 1u 1m\n" + std::string(command) + "\n", "d", "", {});
    EXPECT_THAT(std::string(netlist.status().message()), Not(HasSubstr("not supported"))) << command;
  }
}

TEST(CommandLineTest, TakesStandardInput) {
  const Outcome outcome = Parse({"lcp", "-"});
  ASSERT_TRUE(std::holds_alternative<LcpCommand>(outcome.parsed)) << outcome.err;
  EXPECT_EQ(std::get<LcpCommand>(outcome.parsed).path, "-");
}

TEST(CommandLineTest, TakesTheOptionsOfLcpsAndDcps) {
  const Outcome lcp = Parse({"lcp", "l.json", "--all", "--rule", "hidden-least-element"});
  ASSERT_TRUE(std::holds_alternative<LcpCommand>(lcp.parsed)) << lcp.err;
  EXPECT_TRUE(std::get<LcpCommand>(lcp.parsed).all);
  EXPECT_EQ(std::get<LcpCommand>(lcp.parsed).rule, v1::SOLUTION_RULE_HIDDEN_LEAST_ELEMENT);
  const Outcome dcp = Parse({"dcp", "d.json", "--step", "0.25"});
  ASSERT_TRUE(std::holds_alternative<DcpCommand>(dcp.parsed)) << dcp.err;
  EXPECT_EQ(std::get<DcpCommand>(dcp.parsed).step, 0.25);
  EXPECT_EQ(std::get<DcpCommand>(Parse({"dcp", "d.json", "--check", "v.json"}).parsed).check, "v.json");
  const Outcome analyze = Parse({"analyze", "p.json", "--verbose"});
  ASSERT_TRUE(std::holds_alternative<AnalyzeCommand>(analyze.parsed)) << analyze.err;
  EXPECT_TRUE(std::get<AnalyzeCommand>(analyze.parsed).verbose);
}

TEST(CommandLineTest, ReadsNegativeNumbersAsValues) {
  EXPECT_THAT(Refused({"solve", "p.json", "--theta", "-0.5"}), HasSubstr("\"-0.5\" is not between 0 and 1"));
  EXPECT_THAT(Refused({"solve", "p.json", "--theta", "-.5"}), HasSubstr("\"-.5\" is not between 0 and 1"));
  EXPECT_THAT(Refused({"solve", "p.json", "--at", "-1,2"}), HasSubstr("\"-1\" is not a time"));
}

TEST(CommandLineTest, NamesOptionValueAndRule) {
  EXPECT_THAT(Refused({"solve", "p.json", "--step", "0"}), AllOf(HasSubstr("--step"), HasSubstr("above 0")));
  EXPECT_THAT(Refused({"solve", "p.json", "--step", "nan"}), HasSubstr("\"nan\" is not a number above 0"));
  EXPECT_THAT(Refused({"solve", "p.json", "--step", "1e-3x"}), HasSubstr("\"1e-3x\""));
  EXPECT_THAT(Refused({"solve", "p.json", "--steps", "2.5"}), HasSubstr("\"2.5\" is not a whole number"));
  EXPECT_THAT(Refused({"solve", "p.json", "--at", "0:0:1"}),
              HasSubstr("\"0\" is not the step of a range begin:step:end"));
  EXPECT_THAT(Refused({"solve", "p.json", "--at", "0:1"}), HasSubstr("the end of a range begin:step:end"));
  EXPECT_THAT(Refused({"solve", "p.json", "--at", "2:1:1"}), HasSubstr("\"2:1:1\" is not a range begin:step:end"));
  EXPECT_THAT(Refused({"solve", "p.json", "--at", "0:1e-9:1"}), HasSubstr("at most 10000000 steps"));
  EXPECT_THAT(Refused({"solve", "p.json", "--at", "0.5,,1"}), HasSubstr("\"\" is not a time"));
  EXPECT_THAT(Refused({"solve", "p.json", "--window", "wide"}), HasSubstr("\"wide\" is not auto, whole"));
  EXPECT_THAT(Refused({"solve", "p.json", "--step", "1", "--steps", "3"}), HasSubstr("--step"));
  EXPECT_THAT(Refused({"solve", "p.json", "--deadline", "0"}), HasSubstr("--deadline"));
}

TEST(CommandLineTest, ProposesTheNearestWord) {
  EXPECT_THAT(Refused({"solve", "p.json", "--method", "laplace"}), HasSubstr("did you mean laplace-iteration?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--rule", "leastelement"}), HasSubstr("did you mean least-element?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--rule", "leastnorm"}), HasSubstr("did you mean least-norm?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--kernel", "phi"}), HasSubstr("did you mean phi-functions?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--interpolation", "cubic"}), HasSubstr("did you mean cubic-spline?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--contour", "theorem-2.2"}), HasSubstr("did you mean theorem-2-2?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--step-solver", "newtn"}), HasSubstr("did you mean newton?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--format", "jsn"}), HasSubstr("did you mean json?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--stesp", "3"}), HasSubstr("did you mean --steps?"));
  EXPECT_THAT(Refused({"slove", "p.json"}), HasSubstr("did you mean solve?"));
  const std::string file = dlcs::testing::ExamplePath("rectifier");
  EXPECT_THAT(Refused({file.c_str()}), HasSubstr("is a file, not a command; did you mean dlcs solve " + file + "?"));
}

TEST(CommandLineTest, SaysWhatToDoAboutAWrongOption) {
  EXPECT_THAT(Refused({"solve", "p.json", "q.json"}),
              HasSubstr("\"q.json\" is one word too many; dlcs solve takes PROBLEM alone"));
  EXPECT_THAT(Refused({"ensemble", "p.json", "m.json", "q.json"}),
              HasSubstr("dlcs ensemble takes PROBLEM and MEMBERS"));
  EXPECT_THAT(Refused({"solve", "p.json", "tolerance", "1"}),
              HasSubstr("\"tolerance\" is not known here; did you mean --tolerance?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--step", "1", "--steps", "3"}), HasSubstr("; give one of them"));
  EXPECT_THAT(Refused({"solve", "p.json", "--steps", "1", "--steps", "3"}),
              HasSubstr("--steps is there more than once"));
  EXPECT_THAT(Refused({"solve", "p.json", "--tolerance", "1e-20"}),
              HasSubstr("\"1e-20\" is not a number of at least 1e-13 and below 1"));
  EXPECT_THAT(Refused({"solve", "p.json", "--deadline", "1m"}), HasSubstr("\"1m\" is not a number of seconds above 0"));
  EXPECT_THAT(Refused({"solve", "p.json", "--at", "0:0:1"}),
              HasSubstr("\"0\" is not the step of a range begin:step:end, a number above 0"));
  EXPECT_THAT(Refused({"solve", "p.json", "--at", "0:1:0.1"}),
              HasSubstr("\"0:1:0.1\" has a step of 1 from 0 to 0.1; ranges are begin:step:end, as in 0:0.1:1"));
  EXPECT_THAT(Refused({"submit", "p.json", "--deadline", "3"}), HasSubstr("did you mean --within?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--within", "3"}), HasSubstr("did you mean --deadline?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--rtol", "1e-3"}), HasSubstr("did you mean --tolerance?"));
  EXPECT_THAT(Refused({"list", "--limit", "3"}), Not(HasSubstr("did you mean")));
}

TEST(CommandLineTest, WritesNoTableIntoAFileOfAnotherFormat) {
  EXPECT_THAT(Refused({"solve", "p.json", "--output", "r.svg"}),
              HasSubstr("r.svg would be a table; pictures are drawn by --plot FILE.svg"));
  EXPECT_THAT(
      Refused({"solve", "p.json", "--output", "r.XLSX"}),
      HasSubstr("r.XLSX would be a table, and .xlsx is the ending of another format; name a file that ends with .csv"));
  for (const char* name : {"r.txt", "r", "r.1", "-"}) {
    EXPECT_FALSE(std::holds_alternative<ExitCode>(Parse({"solve", "p.json", "--output", name}).parsed)) << name;
  }
  const Outcome asked = Parse({"solve", "p.json", "--output", "r.xls", "--format", "csv"});
  EXPECT_FALSE(std::holds_alternative<ExitCode>(asked.parsed));
}

TEST(CommandLineTest, NamesAnUnknownOptionBeforeWhatIsMissing) {
  for (const char* command : {"solve", "lcp", "ensemble", "delete"}) {
    EXPECT_THAT(Refused({command, "--hlp"}), AllOf(HasSubstr("\"--hlp\" is not known here; did you mean --help?"),
                                                   ::testing::Not(HasSubstr("required"))));
  }
}

TEST(CommandLineTest, RefusesWhatIsMissing) {
  EXPECT_THAT(Refused({}), HasSubstr("solve, ensemble, analyze, lcp, dcp, model, netlist, plot, capabilities, health, "
                                     "context, workers, completion, man, or with jobs submit, watch"));
  EXPECT_THAT(Refused({"solve"}), HasSubstr("PROBLEM"));
  EXPECT_THAT(Refused({"solve", "p.json", "--step"}), HasSubstr("--step has no value; write --step H"));
  EXPECT_THAT(Refused({"dcp", "d.json", "--step", "-1"}), HasSubstr("\"-1\" is not a number above 0"));
  EXPECT_THAT(Refused({"dcp", "d.json", "--step", "1", "--check", "v.json"}), HasSubstr("--check"));
  EXPECT_THAT(Refused({"lcp", "l.json", "--al"}), HasSubstr("did you mean --all?"));
  EXPECT_THAT(Refused({"lcp", "l.json", "--format", "csv"}), HasSubstr("table, json"));
}

TEST(CommandLineTest, ExplainsItself) {
  for (const std::vector<const char*>& arguments : {std::vector<const char*>{"--help"},
                                                    {"solve", "--help"},
                                                    {"lcp", "--help"},
                                                    {"dcp", "--help"},
                                                    {"capabilities", "--help"}}) {
    const Outcome outcome = Parse(arguments);
    ASSERT_TRUE(std::holds_alternative<ExitCode>(outcome.parsed));
    EXPECT_EQ(std::get<ExitCode>(outcome.parsed), kSolved);
    EXPECT_THAT(outcome.out, AllOf(HasSubstr("Examples:"), HasSubstr("dlcs ")));
    EXPECT_EQ(outcome.err, "");
  }
  EXPECT_THAT(Parse({"solve", "--help"}).out, AllOf(HasSubstr("Exit codes"), HasSubstr("--project-initial-state")));
  EXPECT_THAT(Parse({"--version"}).out, ::testing::MatchesRegex("dlcs [0-9.]+\n"));
}

TEST(CommandLineTest, ProposesWhatWasMeant) {
  EXPECT_THAT(Refused({"solve", "p.json", "--method", "integrator"}),
              HasSubstr("did you mean exponential-integrator?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--method", "RK45"}), HasSubstr("did you mean event-driven?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--method", "implicit_euler"}), HasSubstr("did you mean time-stepping?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--method", "quux"}), Not(HasSubstr("did you mean")));
  EXPECT_THAT(Refused({"solve", "p.json", "--rule", "leastelement"}), HasSubstr("did you mean least-element?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--newton"}), HasSubstr("did you mean --step-solver newton?"));
  EXPECT_THAT(Refused({"solve", "p.json", "--kernel", "phi"}), HasSubstr("did you mean phi-functions?"));
  EXPECT_THAT(Refused({"solve", "p.json", "-f", "jsn"}), HasSubstr("did you mean json?"));
  EXPECT_THAT(Refused({"context", "sett", "lab"}), HasSubstr("did you mean set?"));
}

TEST(CommandLineTest, KnowsNoHelpForWhatIsNoCommand) {
  EXPECT_THAT(Refused({"help", "slove"}), HasSubstr("did you mean solve?"));
  EXPECT_THAT(Refused({"model", "signorni"}), HasSubstr("did you mean signorini?"));
}

TEST(CommandLineTest, TakesNoEmptyNameForAFileOrAJob) {
  for (const std::vector<const char*>& arguments :
       std::vector<std::vector<const char*>>{{"solve", ""},
                                             {"solve", "p.json", "--output", ""},
                                             {"solve", "p.json", "--grid", ""},
                                             {"solve", "p.json", "--token-file", ""},
                                             {"ensemble", "p.json", ""},
                                             {"watch", ""},
                                             {"get", ""}}) {
    EXPECT_THAT(Refused(arguments), HasSubstr("is empty; is a variable of your script unset?")) << arguments[0];
  }
}

TEST(CommandLineTest, SaysWhatAGridAndNumbersOfStepsAre) {
  EXPECT_THAT(Refused({"solve", "p.json", "--grid", "1,2,zz"}),
              AllOf(HasSubstr("--grid"), HasSubstr("\"zz\" is not a time")));
  EXPECT_THAT(Refused({"solve", "p.json", "--grid", "nodes"}), AllOf(HasSubstr("no such file"), HasSubstr("0.1,0.5")));
  for (const char* steps : {"0", "99999999999"}) {
    EXPECT_THAT(Refused({"solve", "p.json", "--steps", steps}), HasSubstr("between 1 and 1000000000"));
  }
  EXPECT_THAT(Refused({"solve", "p.json", "--contour-nodes", "10001"}), HasSubstr("between 1 and 10000"));
  EXPECT_THAT(Refused({"solve", "p.json", "--max-iterations", "3000000000"}), HasSubstr("between 1 and 2147483647"));
  EXPECT_THAT(Refused({"solve", "p.json", "--window", "3000000000"}), HasSubstr("from 1 to 2147483647"));
}

TEST(CommandLineTest, HelpIsThatOfTheCommandInGroups) {
  const Outcome help = Parse({"help", "solve"});
  EXPECT_EQ(std::get<ExitCode>(help.parsed), kSolved);
  EXPECT_EQ(help.out, Parse({"solve", "--help"}).out);
  const std::size_t everyday = help.out.find("\nEveryday:"), method = help.out.find("\nOnly time-stepping:");
  const std::size_t server = help.out.find("\nServer:");
  ASSERT_NE(server, std::string::npos) << help.out;
  EXPECT_LT(everyday, method);
  EXPECT_LT(method, server);
  EXPECT_LT(help.out.find("--tolerance"), method);
  EXPECT_GT(help.out.find("--theta"), method);
  EXPECT_EQ(Parse({"help"}).out, Parse({"--help"}).out);
  EXPECT_THAT(Parse({"help", "context", "set"}).out, HasSubstr("--tls-ca"));
}

TEST(CommandLineTest, EveryJobCommandHasExamplesOfItsOwn) {
  const auto examples = [](const char* command) {
    const std::string help = Parse({"help", command}).out;
    return help.substr(help.find("Examples:"));
  };
  EXPECT_THAT(examples("result"), AllOf(HasSubstr("dlcs result"), Not(HasSubstr("dlcs cancel"))));
  EXPECT_THAT(examples("list"), AllOf(HasSubstr("dlcs list"), Not(HasSubstr("dlcs watch"))));
}

}  // namespace
}  // namespace dlcs::client

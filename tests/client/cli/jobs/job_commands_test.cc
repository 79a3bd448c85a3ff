// SPDX-License-Identifier: Apache-2.0
// `dlcs submit`, `watch`, `get`, `list`, `cancel`, `result` and `delete` as people and scripts use them.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "server/dlcs_server.h"
#include "spdlog/spdlog.h"
#include "tests/client/cli/program.h"
#include "tests/server/store/temporary_folder.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

// M = 0 and N B = 0: there is no solution without impact laws.
constexpr const char* kUnsupported =
    R"json({"A": [[0, 1], [0, 0]], "B": [[0], [1]], "N": [[1, 0]], "M": [[0]],
            "x0": [1, 0], "T": 4, "f": [0, -1], "g": [0]})json";

class JobCommandsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    spdlog::set_level(spdlog::level::off);
    Start({});
  }

  void Start(ServerConfig config) {
    server_.reset();
    config.listen = "127.0.0.1:0";
    config.store = folder_.File("jobs.db");
    auto server = DlcsServer::Start(config);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
  }

  ProgramOutcome Dlcs(const std::string& arguments, const std::string& json = "") const {
    return RunDlcs(arguments + " --server " + server_->address(), json.empty() ? "" : "echo '" + json + "' | ");
  }

  // The name of the job.
  std::string Submit(const std::string& json, const std::string& options) const {
    const ProgramOutcome outcome = Dlcs("submit - " + options, json);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    EXPECT_THAT(outcome.out, MatchesRegex("jobs/[a-z2-7]+\n"));
    return outcome.out.substr(0, outcome.out.find('\n'));
  }

  // The name of the job.
  std::string Detach(const std::string& arguments, const std::string& json) const {
    const ProgramOutcome outcome = Dlcs(arguments + " --detach", json);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out.substr(0, outcome.out.find('\n'));
  }

  jobs::testing::TemporaryFolder folder_;
  std::unique_ptr<DlcsServer> server_;
};

TEST_F(JobCommandsTest, AJobPrintsWhatASolvePrints) {
  const std::string job = Submit(kEasyProblem, "--steps 500");
  const ProgramOutcome watched = Dlcs("watch " + job);
  EXPECT_EQ(watched.code, 0) << watched.err;
  EXPECT_THAT(watched.err, HasSubstr("succeeded"));
  const ProgramOutcome here = SolveText(kEasyProblem, "--steps 500 --format csv --quiet");
  const ProgramOutcome there = Dlcs("result " + job + " --format csv");
  EXPECT_EQ(there.code, 0) << there.err;
  EXPECT_EQ(there.out, here.out);
  SolveText(kEasyProblem, "--steps 500 --quiet --output " + folder_.File("here.npy"));
  EXPECT_EQ(Dlcs("result " + job + " --output " + folder_.File("there.npy")).code, 0);
  const auto bytes = [this](const char* name) {
    std::ifstream stream(folder_.File(name), std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  EXPECT_THAT(bytes("here.npy"), HasSubstr("NUMPY"));
  EXPECT_EQ(bytes("here.npy"), bytes("there.npy"));
  for (const std::string format : {"npz", "hdf5", "mat"}) {
    EXPECT_EQ(Dlcs("result " + job + " --format " + format + " --output " + folder_.File("r." + format)).code, 0);
  }
  const ProgramOutcome table = Dlcs("result " + job);
  EXPECT_EQ(table.code, 0);
  EXPECT_THAT(table.out, HasSubstr("estimated error"));
  const auto json = nlohmann::json::parse(Dlcs("result " + job + " --format json --from 1 --to 2").out);
  EXPECT_EQ(json["summary"]["termination"], "TERMINATION_REACHED_END");
  EXPECT_EQ(json["trajectory"]["times"].front(), 1);
  EXPECT_EQ(json["trajectory"]["times"].back(), 2);
}

TEST_F(JobCommandsTest, WatchExitsAsSolveWould) {
  const std::string job = Submit(kUnsupported, "--steps 10");
  const ProgramOutcome watched = Dlcs("watch --quiet " + job);
  EXPECT_EQ(watched.code, 1) << watched.err;
  EXPECT_THAT(watched.err, HasSubstr("UNSUPPORTED"));
  EXPECT_EQ(Dlcs("result " + job).code, 1);
  // The state of the job, "succeeded", does not show this.
  const std::string rough = Submit(kEasyProblem, "--steps 10 --no-estimate-error");
  EXPECT_EQ(Dlcs("watch --quiet " + rough).code, 0);
  EXPECT_THAT(Dlcs("get " + rough).out, HasSubstr("verdict    reached T, error not estimated: Reached T"));
  EXPECT_EQ(Dlcs("watch jobs/abcdefghijklmnopqrstuvwxyz").code, 3);
  EXPECT_EQ(Dlcs("watch nonsense").code, 2);
}

TEST_F(JobCommandsTest, WatchPrintsEventsForPrograms) {
  const std::string job = Submit(kEasyProblem, "--steps 100");
  const ProgramOutcome watched = Dlcs("watch --format json " + job);
  EXPECT_EQ(watched.code, 0) << watched.err;
  std::istringstream lines(watched.out);
  nlohmann::json last;
  for (std::string line; std::getline(lines, line);) last = nlohmann::json::parse(line);
  EXPECT_EQ(last["summary"]["termination"], "TERMINATION_REACHED_END");
}

// As in the JSON of a solve: names with underscores; integers of 64 bits are strings.
TEST_F(JobCommandsTest, PrintsJobsAsJsonLikeAllOther) {
  const std::string job = Submit(kEasyProblem, "--steps 100 --method time-stepping");
  const ProgramOutcome watched = Dlcs("watch --format json " + job);
  ASSERT_EQ(watched.code, 0) << watched.err;
  const auto first = nlohmann::json::parse(watched.out.substr(0, watched.out.find('\n')));
  EXPECT_EQ(first["sequence"], "1");
  EXPECT_THAT(first["time"].get<std::string>(), MatchesRegex("20..-..-..T.*Z"));
  const ProgramOutcome listed = Dlcs("list --format json");
  const auto about = nlohmann::json::parse(listed.out);
  EXPECT_EQ(about["state"], "JOB_STATE_SUCCEEDED");
  EXPECT_EQ(about["options"]["steps"], 100);
  EXPECT_EQ(about["options"]["method"], "METHOD_TIME_STEPPING");
  EXPECT_GT(std::stoll(about["stored_bytes"].get<std::string>()), 0);
  EXPECT_THAT(about["create_time"].get<std::string>(), MatchesRegex("20..-..-..T.*Z"));
  EXPECT_THAT(listed.out + watched.out, Not(ContainsRegex("\"[a-z]+[A-Z]")));
}

TEST_F(JobCommandsTest, WatchAsksForTheFunctionOfIterates) {
  const std::string job = Submit(kEasyProblem, "--steps 100 --method laplace-iteration --window whole");
  EXPECT_EQ(Dlcs("watch --format json --values sampled " + job).code, 0);
  EXPECT_EQ(Dlcs("watch --format json --values full --components 0,0 " + job).code, 0);
  const ProgramOutcome none = Dlcs("watch --format json --values full --components 0,3 " + job);
  EXPECT_EQ(none.code, 2);
  EXPECT_THAT(none.err, HasSubstr("y_components[1]: 3; must be between 0 and 0"));
  const ProgramOutcome table = Dlcs("watch --values full " + job);
  EXPECT_EQ(table.code, 2);
  EXPECT_THAT(table.err, HasSubstr("--format json"));
  EXPECT_EQ(Dlcs("watch --components 0 " + job).code, 2);
  const ProgramOutcome unknown = Dlcs("watch --format json --values fall " + job);
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("did you mean full?"));
}

TEST_F(JobCommandsTest, CancelsListsAndForgets) {
  const std::string job = Submit(kEasyProblem, "--steps 4000000 --method time-stepping");
  EXPECT_THAT(Dlcs("list").out, HasSubstr(job));
  EXPECT_EQ(Dlcs("result " + job).code, 3);  // not yet
  EXPECT_EQ(Dlcs("cancel " + job).code, 0);
  const ProgramOutcome watched = Dlcs("watch --quiet " + job);
  EXPECT_EQ(watched.code, 3);
  EXPECT_THAT(watched.err, HasSubstr("cancelled"));
  EXPECT_THAT(Dlcs("get " + job).out, HasSubstr("cancelled"));
  EXPECT_THAT(Dlcs("get " + job).out, HasSubstr("core-seconds"));
  EXPECT_EQ(Dlcs("list --state queued,running").out, "");
  EXPECT_THAT(Dlcs("list --state cancelled,failed").out, HasSubstr(job));
  const ProgramOutcome unknown = Dlcs("list --state done");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("\"done\" is none of queued, running"));
  EXPECT_EQ(Dlcs("delete " + job).code, 0);
  EXPECT_EQ(Dlcs("get " + job).code, 3);
  EXPECT_EQ(Dlcs("list").out, "");
}

TEST_F(JobCommandsTest, AJobThatNeverBeganHasNoResult) {
  ServerConfig one_at_a_time;
  one_at_a_time.max_concurrent_solves = 1;
  Start(one_at_a_time);
  const std::string first = Submit(kEasyProblem, "--steps 4000000 --method time-stepping");
  const std::string second = Submit(kEasyProblem, "--steps 4000000 --method time-stepping");
  EXPECT_EQ(Dlcs("cancel " + second).code, 0);
  const ProgramOutcome outcome = Dlcs("result " + second);
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, HasSubstr("was cancelled before it began"));
}

TEST_F(JobCommandsTest, SaysWhatIsWrongBeforeItIsTaken) {
  const ProgramOutcome checked = Dlcs("submit - --check --steps 100", kEasyProblem);
  EXPECT_EQ(checked.code, 0);
  EXPECT_EQ(checked.out, "");
  EXPECT_THAT(checked.err, HasSubstr("core-seconds"));
  const ProgramOutcome wrong =
      Dlcs("submit - --steps 100",
           R"json({"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[2]], "x0": [1], "T": -4, "f": [0], "g": [-1]})json");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("T"));
  EXPECT_EQ(Dlcs("list").out, "");
  EXPECT_EQ(Dlcs("submit - --within 2 --patience 1 --method time-stepping --steps 15000000", kEasyProblem).code, 3);
}

TEST_F(JobCommandsTest, ASolveIsAJobThatLeavesNothing) {
  const std::string options = "solve - --steps 500 --format csv --quiet";
  const ProgramOutcome here = RunDlcs(options, std::string("echo '") + kEasyProblem + "' | ");
  const ProgramOutcome there = Dlcs(options, kEasyProblem);
  EXPECT_EQ(there.code, 0) << there.err;
  EXPECT_EQ(there.err, "");
  EXPECT_EQ(there.out, here.out);
  EXPECT_EQ(Dlcs("list").out, "");
}

TEST_F(JobCommandsTest, AProblemIsUploadedOnceAndSolvedByName) {
  const ProgramOutcome uploaded = Dlcs("upload -", kEasyProblem);
  EXPECT_EQ(uploaded.code, 0);
  EXPECT_EQ(uploaded.err, "");
  ASSERT_THAT(uploaded.out, MatchesRegex("problems/[0-9a-f]+\n"));
  const std::string name = uploaded.out.substr(0, uploaded.out.size() - 1);
  const ProgramOutcome again = Dlcs("upload -", kEasyProblem);
  EXPECT_EQ(again.out, uploaded.out);
  EXPECT_EQ(again.err, "dlcs: it was uploaded already\n");
  EXPECT_THAT(Dlcs("problems").out, HasSubstr(name));
  EXPECT_THAT(Dlcs("get " + name).out, HasSubstr("1 state, 1 pair, T = 4"));

  for (const char* format : {"csv", "table"}) {
    const std::string options = std::string(" --steps 500 --quiet --format ") + format;
    const ProgramOutcome of_file = Dlcs("solve -" + options, kEasyProblem);
    const ProgramOutcome of_name = Dlcs("solve " + name + options);
    EXPECT_EQ(of_name.code, 0) << of_name.err;
    // A table starts with the name of the problem and ends with the time that the solve took.
    EXPECT_EQ(of_name.out.substr(of_name.out.find('\n'), 300), of_file.out.substr(of_file.out.find('\n'), 300));
  }
  const ProgramOutcome analyzed = Dlcs("analyze " + name);
  EXPECT_EQ(analyzed.code, 0) << analyzed.err;
  EXPECT_THAT(analyzed.out, HasSubstr("dlcs solve " + name + " --server " + server_->address()));
  const ProgramOutcome submitted = Dlcs("submit " + name + " --steps 100");
  EXPECT_EQ(submitted.code, 0) << submitted.err;
  EXPECT_EQ(Dlcs("watch --quiet " + submitted.out.substr(0, submitted.out.size() - 1)).code, 0);

  EXPECT_EQ(Dlcs("delete " + name).code, 0);
  EXPECT_EQ(Dlcs("problems").out, "");
  const ProgramOutcome gone = Dlcs("solve " + name);
  EXPECT_EQ(gone.code, 3);
  EXPECT_THAT(gone.err, HasSubstr("There is no uploaded problem"));
  const ProgramOutcome nowhere = RunDlcs("solve " + name);
  EXPECT_EQ(nowhere.code, 2);
  EXPECT_THAT(nowhere.err, HasSubstr("--server HOST:PORT"));
  EXPECT_EQ(Dlcs("solve " + name + " --rule least-norm").code, 2);
  EXPECT_EQ(Dlcs("upload -", R"('{"A": [[-1]]}')").code, 2);
}

TEST_F(JobCommandsTest, ListsJobsWithTitlesAgesAndMethods) {
  const std::string job = Submit(kEasyProblem, "--steps 100 --method time-stepping --title 'diode, warm'");
  EXPECT_EQ(Dlcs("watch --quiet " + job).code, 0);
  const ProgramOutcome list = Dlcs("list");
  EXPECT_THAT(list.out, MatchesRegex("NAME +TITLE +STATE +VERDICT +PROGRESS +AGE +METHOD\n" + job +
                                     " +diode, warm +succeeded +reached T +100 % +[0-9]+s +time-stepping\n"));
  EXPECT_EQ(Dlcs("list -o name").out, job + "\n");
  EXPECT_EQ(nlohmann::json::parse(Dlcs("list -o json").out)["title"], "diode, warm");
  const ProgramOutcome get = Dlcs("get " + job);
  EXPECT_THAT(get.out, HasSubstr("1 state, 1 pair, T = 4"));
  EXPECT_THAT(get.out, HasSubstr("--method time-stepping --steps 100"));
  EXPECT_THAT(Dlcs("cancel " + job).err, HasSubstr("has succeeded already"));
  EXPECT_THAT(Dlcs("result " + job).out, ::testing::StartsWith("diode, warm: "));
}

TEST_F(JobCommandsTest, ListsHowJobsEnded) {
  const auto row = [this](const std::string& problem, const std::string& options) {
    const std::string job = Submit(problem, options);
    Dlcs("watch --quiet " + job);
    const std::string list = Dlcs("list").out;
    const std::size_t begin = list.find(job);
    return list.substr(begin, list.find('\n', begin) - begin);
  };
  EXPECT_THAT(row(kEasyProblem, "--tolerance 1e-6"), HasSubstr(" succeeded  SOLVED "));
  EXPECT_THAT(row(kUnsupported, "--steps 10"), HasSubstr(" succeeded  UNSUPPORTED "));
  // An oscillation with steps nearly as long as a period.
  EXPECT_THAT(
      row(R"({"A": [[0, 1], [-400, 0]], "B": [[0], [1]], "N": [[1, 0]], "M": [[0.001]], "x0": [1, 0], "T": 20})",
          "--method time-stepping --steps 100"),
      HasSubstr(" succeeded  inaccurate "));
}

TEST_F(JobCommandsTest, TakesTheFirstLettersOfAName) {
  const std::string first = Submit(kEasyProblem, "--steps 10"), second = Submit(kEasyProblem, "--steps 20");
  const std::string letters = first.substr(5);
  std::size_t shared = 0;
  while (letters[shared] == second[5 + shared]) ++shared;
  EXPECT_THAT(Dlcs("get " + letters.substr(0, shared + 1)).out, HasSubstr(first));
  EXPECT_THAT(Dlcs("get jobs/" + letters.substr(0, shared + 1)).out, HasSubstr(first));
  EXPECT_THAT(Dlcs("get " + letters).out, HasSubstr(first));
  const ProgramOutcome none = Dlcs("get " + std::string(20, letters[0] == 'a' ? 'b' : 'a'));
  EXPECT_EQ(none.code, 2);
  EXPECT_THAT(none.err, HasSubstr("no job has a name that begins with"));
  const ProgramOutcome all = Dlcs("get jobs/");
  EXPECT_EQ(all.code, 2);
  EXPECT_THAT(Dlcs("get no/job").err, HasSubstr("is not the name of a job"));
}

TEST_F(JobCommandsTest, SubmitsWaitsAndForgetsAll) {
  const ProgramOutcome waited = Dlcs("submit - --steps 100 --wait", kEasyProblem);
  EXPECT_EQ(waited.code, 0) << waited.err;
  EXPECT_THAT(waited.out, MatchesRegex("jobs/[a-z2-7]+\n"));
  EXPECT_THAT(waited.err, HasSubstr("succeeded"));
  EXPECT_EQ(Dlcs("submit - --steps 10 --wait --quiet", kUnsupported).code, 1);
  EXPECT_EQ(Dlcs("delete").code, 2);
  EXPECT_EQ(Dlcs("delete --all --state running").code, 2);
  EXPECT_EQ(Dlcs("delete --all --state failed").err, "dlcs: deleted 0 jobs\n");
  EXPECT_EQ(Dlcs("delete --all").err, "dlcs: deleted 2 jobs\n");
  EXPECT_EQ(Dlcs("list").out, "");
}

TEST_F(JobCommandsTest, ResultsAreShownAtTheNearestTimes) {
  const std::string job = Submit(kEasyProblem, "--steps 8");
  EXPECT_EQ(Dlcs("watch --quiet " + job).code, 0);
  const ProgramOutcome outcome = Dlcs("result " + job + " --at 2.6,1,2.4 --format json");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["trajectory"]["times"], nlohmann::json({1.0, 2.5}));
  EXPECT_THAT(outcome.err, HasSubstr("--at 2.6: is not a stored time; the nearest is 2.5"));
  EXPECT_THAT(outcome.err, ::testing::Not(HasSubstr("--at 1:")));
}

TEST_F(JobCommandsTest, ProgressNeverGoesBackWhereFewTimesAreKept) {
  const std::string job =
      Submit(kEasyProblem, "--steps 2000000 --method time-stepping --at 0.1,0.2,1 --no-estimate-error");
  const ProgramOutcome watched = Dlcs("watch --format json " + job);
  EXPECT_EQ(watched.code, 0) << watched.err;
  std::istringstream lines(watched.out);
  double time = 0, progress = 0;
  for (std::string line; std::getline(lines, line);) {
    const auto event = nlohmann::json::parse(line);
    if (!event.contains("checkpointed")) continue;
    EXPECT_GE(event["checkpointed"]["time"].get<double>(), time);
    EXPECT_GE(event["checkpointed"]["progress"].get<double>(), progress);
    time = event["checkpointed"]["time"].get<double>();
    progress = event["checkpointed"]["progress"].get<double>();
  }
  EXPECT_GT(time, 0);
}

TEST_F(JobCommandsTest, SaysAtOnceWhereNobodyServes) {
  for (const char* command : {"list", "get jobs/abcdefghijklmnopqrstuvwxyz", "submit"}) {
    const std::string input = command == std::string("submit") ? " -" : "";
    const ProgramOutcome outcome =
        RunDlcs(command + input + " --server 127.0.0.1:1", std::string("echo '") + kEasyProblem + "' | ");
    EXPECT_EQ(outcome.code, 3);
    EXPECT_THAT(outcome.err, HasSubstr("no server answers at 127.0.0.1:1"));
    EXPECT_THAT(outcome.err, ::testing::Not(HasSubstr("again in")));
  }
  const ProgramOutcome elsewhere = RunDlcs("health --server nowhere.invalid:1");
  EXPECT_THAT(elsewhere.err, HasSubstr("no host \"nowhere.invalid\" was found"));
  EXPECT_THAT(elsewhere.err, ::testing::Not(HasSubstr("dlcsd --listen")));
}

TEST_F(JobCommandsTest, TellsThatItTriesAgain) {
  const ProgramOutcome outcome = RunDlcs("list --server 127.0.0.1:1 --patience 0.6");
  EXPECT_EQ(outcome.code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("no server answers (Connection refused); retrying in"));
}

TEST_F(JobCommandsTest, AnEnsembleIsAJobToo) {
  const std::string members = folder_.File("members.csv");
  std::ofstream(members) << "x1\n1\n2\n3\n";
  const ProgramOutcome detached = Dlcs("ensemble - " + members + " --steps 100 --detach --extrema", kEasyProblem);
  ASSERT_EQ(detached.code, 0) << detached.err;
  ASSERT_THAT(detached.out, MatchesRegex("jobs/[a-z2-7]+\n"));
  const std::string job = detached.out.substr(0, detached.out.find('\n'));
  const ProgramOutcome watched = Dlcs("watch " + job);
  EXPECT_EQ(watched.code, 0) << watched.err;
  EXPECT_THAT(watched.err, AllOf(HasSubstr("3 of 3 members (100 %)"), HasSubstr("succeeded")));
  EXPECT_THAT(Dlcs("get " + job).out, HasSubstr("members    3, in 1 shard of up to 3, 1 done"));
  EXPECT_THAT(Dlcs("list").out, HasSubstr(job));

  const ProgramOutcome table = Dlcs("result " + job);
  EXPECT_EQ(table.code, 0) << table.err;
  EXPECT_THAT(table.out, AllOf(HasSubstr("median"), HasSubstr("max(x1)"), HasSubstr("mean")));
  // The ends of the same ensemble in this process, with the same bits.
  const ProgramOutcome here = RunDlcs("ensemble - " + members + " --steps 100 --format csv --quiet",
                                      std::string("echo '") + kEasyProblem + "' | ");
  std::vector<std::string> ends;  // x1 at the last time of each member
  std::istringstream lines(here.out);
  std::string member, label, t, x1;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream fields(line);
    for (std::string* field : {&member, &label, &t, &x1}) std::getline(fields, *field, ',');
    if (t == "4") ends.push_back(x1);
  }
  ASSERT_EQ(ends.size(), 3U) << here.out.substr(0, 200);
  const ProgramOutcome csv = Dlcs("result " + job + " --format csv");
  EXPECT_THAT(csv.out, HasSubstr("member,outcome,t,error,x1,min(x1),max(x1),y1,min(y1),max(y1),w1,"));
  for (const std::string& end : ends) EXPECT_THAT(csv.out, HasSubstr("," + end + ","));
  const ProgramOutcome json = Dlcs("result " + job + " --format json");
  EXPECT_EQ(nlohmann::json::parse(json.out.substr(0, json.out.find('\n')))["member"], 0);
  for (const std::string format : {"npz", "hdf5", "mat"}) {
    const std::string file = folder_.File("e." + format);
    EXPECT_EQ(Dlcs("result " + job + " --format " + format + " --output " + file).code, 0);
    EXPECT_GT(std::filesystem::file_size(file), 100U);
  }
  EXPECT_EQ(Dlcs("result " + job + " --at 1").code, 2);
  EXPECT_EQ(Dlcs("result " + job + " --output " + folder_.File("e.npy")).code, 2);
  EXPECT_EQ(Dlcs("delete " + job).code, 0);
}

// The fields of the first line of CSV.
std::vector<std::string> FirstFields(const std::string& csv) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t k = 0; k < csv.size() && (quoted || csv[k] != '\n'); ++k) {
    if (csv[k] == '"' && quoted && csv[k + 1] == '"')
      fields.back() += csv[++k];
    else if (csv[k] == '"')
      quoted = !quoted;
    else if (csv[k] == ',' && !quoted)
      fields.emplace_back();
    else
      fields.back() += csv[k];
  }
  return fields;
}

TEST_F(JobCommandsTest, ValuesOfAnEnsembleHaveNamesOfTheirOwn) {
  const std::string members = folder_.File("members.csv");
  std::ofstream(members) << "x1\n1\n2\n";
  constexpr const char* kProblem =
      R"json({"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[2]], "x0": [1], "T": 4, "g": [-1],
      "states": ["x"], "pairs": ["outcome"], "outputs": {
        "names": ["x", "t", "member", "error", "max(x)", "message", "a,b", "say \"hi\"", "output:t"],
        "C": [[1], [2], [3], [4], [5], [6], [7], [8], [9]]}})json";
  for (const std::string extrema : {"", " --extrema"}) {
    const std::string job = Detach("ensemble - " + members + " --steps 10" + extrema, kProblem);
    const ProgramOutcome csv = Dlcs("result " + job + " --format csv");
    const std::vector<std::string> fields = FirstFields(csv.out);
    const std::set<std::string> names(fields.begin(), fields.end());
    EXPECT_EQ(names.size(), fields.size()) << csv.out;
    EXPECT_EQ(fields.size(), extrema.empty() ? 16U : 40U) << csv.out;
    for (const char* name : {"x", "y:outcome", "output:x", "output:t", "output:max(x)", "a,b", "say \"hi\""}) {
      EXPECT_TRUE(names.contains(name)) << name << " in " << csv.out;
    }
    std::istringstream lines(Dlcs("result " + job + " --format json").out);
    for (std::string line; std::getline(lines, line);) {
      const auto member = nlohmann::json::parse(line);
      EXPECT_EQ(member.size(), fields.size());
      EXPECT_TRUE(member["member"].is_number_integer());
      EXPECT_EQ(member["t"], 4);
      EXPECT_EQ(member["output:member"].get<double>(), 3 * member["x"].get<double>());
    }
  }
}

TEST_F(JobCommandsTest, TheDeadlineOfADetachedEnsembleIsThatOfTheJob) {
  const std::string members = folder_.File("members.csv");
  std::ofstream(members) << "x1\n1\n2\n";
  const std::string job = Detach("ensemble - " + members + " --steps 10 --deadline 3000", kEasyProblem);
  EXPECT_THAT(Dlcs("get " + job).out, HasSubstr("  deadline   2"));
  const std::string other = Detach("ensemble - " + members + " --steps 10", kEasyProblem);
  EXPECT_THAT(Dlcs("get " + other).out, Not(HasSubstr("deadline")));
  const ProgramOutcome late = Dlcs("ensemble - " + members + " --steps 1000000 --detach --deadline 1e-3", kEasyProblem);
  EXPECT_NE(late.code, 0);
  EXPECT_THAT(late.err, AllOf(HasSubstr("deadline"), Not(HasSubstr("dlcsd listens"))));
  const ProgramOutcome passed = Dlcs("ensemble - " + members + " --steps 10 --detach --deadline 1e-6", kEasyProblem);
  EXPECT_NE(passed.code, 0);
  EXPECT_THAT(passed.err, HasSubstr("deadline: passed"));
}

// Points of a sweep that change sources alone share their matrices, and are one job.
TEST_F(JobCommandsTest, ASweepIsAJobForEachSetOfMatrices) {
  const std::string deck = folder_.File("sweep.cir");
  const std::string circuit = "charger\nV1 a 0 {V}\nR1 a b {R}\nC1 b 0 1u\n.tran 1u 1m uic\n.print v(b)\n";
  std::ofstream(deck) << circuit << ".step param V list 5 10\n.step param R list 1k 2k\n.end\n";
  const ProgramOutcome detached = Dlcs("ensemble " + deck + " --tolerance 1e-8 --detach --quiet --deadline 3000");
  ASSERT_EQ(detached.code, 0) << detached.err;
  ASSERT_THAT(detached.out, MatchesRegex("jobs/[a-z2-7]+\njobs/[a-z2-7]+\n"));
  std::istringstream jobs(detached.out);
  for (std::string job; std::getline(jobs, job);) {
    EXPECT_EQ(Dlcs("watch " + job).code, 0);
    EXPECT_THAT(Dlcs("get " + job).out, AllOf(HasSubstr("charger: V=5, R="), HasSubstr("; V=10, R="),
                                              HasSubstr("2 solved"), HasSubstr("deadline")));
    EXPECT_EQ(Dlcs("result " + job).code, 0);
  }
  EXPECT_NE(Dlcs("ensemble " + deck + " --detach --quiet --deadline 1e-3").code, 0);
}

TEST_F(JobCommandsTest, OptionsThatADetachedEnsembleCannotKeepAreRefused) {
  const std::string members = folder_.File("members.csv");
  std::ofstream(members) << "x1\n1\n";
  for (const std::string option : {"--format csv", "-o e.csv", "--local", "--at 1"}) {
    const ProgramOutcome outcome =
        RunDlcs("ensemble - " + members + " --detach " + option, std::string("echo '") + kEasyProblem + "' | ");
    EXPECT_EQ(outcome.code, 2) << option;
    EXPECT_THAT(outcome.err, HasSubstr("--detach")) << option;
  }
  EXPECT_EQ(Dlcs("list -o name").out, "");
}

// x' = y + f, 0 <= y, x - y >= 0 complementary: without a solution from x < 0 on.
TEST_F(JobCommandsTest, WhatIsKeptOfAMemberThatBreaksDownDependsOnNoOption) {
  constexpr const char* kBreaks = R"json({"A": [[0]], "B": [[1]], "N": [[1]], "M": [[-1]], "x0": [1], "T": 1,
                                          "f": ["0"], "g": ["0"]})json";
  const std::string members = folder_.File("members.json");
  std::ofstream(members) << R"json([{"x0": [1]}, {"x0": [0.5], "f": ["-1"]}, {"x0": [-1]}])json";
  std::set<std::string> ends;
  for (const std::string option : {"", " --extrema", " --extrema --at 0.25"}) {
    const std::string job = Detach("ensemble - " + members + " --steps 1000" + option, kBreaks);
    const ProgramOutcome json = Dlcs("result " + job + " --format json");
    EXPECT_EQ(json.code, 1) << json.err;
    std::istringstream lines(json.out);
    for (std::string line; std::getline(lines, line);) {
      const auto member = nlohmann::json::parse(line);
      if (member["member"] != 1) continue;
      EXPECT_EQ(member["outcome"], "failed");
      EXPECT_THAT(member["message"].get<std::string>(), HasSubstr("0.5"));
      EXPECT_NEAR(member["t"].get<double>(), 0.5, 2e-3);
      EXPECT_NEAR(member["x1"].get<double>(), 0, 2e-3);
      EXPECT_EQ(member.value("min(x1)", member["x1"]), member["x1"]);  // with extrema
      ends.insert(fmt::format("{} {} {}", member["t"].dump(), member["x1"].dump(), member["y1"].dump()));
    }
  }
  EXPECT_EQ(ends.size(), 1U) << fmt::format("{}", fmt::join(ends, "; "));
}

TEST_F(JobCommandsTest, ATableSaysHowManyFailuresItDoesNotTell) {
  const std::string members = folder_.File("members.csv");
  std::ofstream stream(members);
  stream << "x1\n";
  for (int k = 0; k < 30; ++k) stream << "-1\n";
  stream.close();
  const std::string job = Detach("ensemble - " + members + " --steps 10",
                                 R"json({"A": [[0]], "B": [[1]], "N": [[1]], "M": [[-1]], "x0": [1], "T": 1})json");
  const ProgramOutcome table = Dlcs("result " + job);
  EXPECT_EQ(table.code, 1) << table.err;
  EXPECT_THAT(table.out,
              AllOf(HasSubstr("Member 9: "), Not(HasSubstr("Member 10: ")), HasSubstr("and 20 more failed")));
}

TEST_F(JobCommandsTest, APeriodTakesThePlaceOfTheEnd) {
  constexpr const char* kDriven = R"json({"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [0], "T": 2,
                                          "f": ["0"], "g": ["-sin(2*pi*t)"]})json";
  const std::string members = folder_.File("members.json");
  std::ofstream(members) << R"json([{"x0": [0]}, {"g": ["-2*sin(2*pi*t)"]}])json";
  const std::string arguments = "ensemble - " + members + " --steps 100 --periodic 1";
  const std::string job = Detach(arguments, kDriven);
  const ProgramOutcome json = Dlcs("result " + job + " --format json");
  EXPECT_EQ(nlohmann::json::parse(json.out.substr(0, json.out.find('\n')))["t"], 1) << json.out << json.err;
  const ProgramOutcome here = RunDlcs(arguments + " --local", std::string("echo '") + kDriven + "' | ");
  EXPECT_EQ(here.code, 0) << here.err;
}

TEST_F(JobCommandsTest, AnEnsembleThatIsTooLargeForAMessageSaysWhatToDo) {
  ServerConfig config;
  config.listen = "127.0.0.1:0";
  config.store = folder_.File("small.db");
  config.max_message_bytes = 100'000;
  server_ = *DlcsServer::Start(config);
  const std::string members = folder_.File("members.csv");
  std::ofstream stream(members);
  stream << "x1\n";
  for (int k = 0; k < 20'000; ++k) stream << "1\n";
  stream.close();
  const ProgramOutcome outcome = Dlcs("ensemble - " + members + " --detach", kEasyProblem);
  EXPECT_NE(outcome.code, 0);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("--max-message-bytes"), HasSubstr("split ")));
}

TEST_F(JobCommandsTest, ACancelledEnsembleSaysHowManyMembersAreMissing) {
  const std::string members = folder_.File("members.csv");
  std::ofstream stream(members);
  stream << "x1\n";
  for (int k = 0; k < 20'000; ++k) stream << "1\n";
  stream.close();
  const std::string job = Detach("ensemble - " + members + " --steps 20000", kEasyProblem);
  EXPECT_EQ(Dlcs("cancel " + job).code, 0);
  const ProgramOutcome csv = Dlcs("result " + job + " --format csv");
  EXPECT_EQ(csv.code, 3) << csv.err;
  EXPECT_THAT(csv.err, AllOf(HasSubstr("was cancelled"), HasSubstr(" of 20000 members missing")));
}

TEST_F(JobCommandsTest, WhatIsWrongWithAMemberIsNamedAsInItsFile) {
  const std::string members = folder_.File("members.json");
  std::ofstream(members) << R"json([{"x0": [1]}, {"x0": [2], "T": -1}])json";
  const ProgramOutcome detached = Dlcs("ensemble - " + members + " --detach", kEasyProblem);
  EXPECT_EQ(detached.code, 2);
  EXPECT_THAT(detached.err, HasSubstr("members[1].T"));
  EXPECT_EQ(Dlcs("ensemble - --detach", kEasyProblem).code, 2);
}

}  // namespace
}  // namespace dlcs::client

// SPDX-License-Identifier: Apache-2.0
#include "client/cli/options/solve_option_table.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <variant>
#include <vector>

#include "client/cli/command_line.h"

namespace dlcs::client {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

void AddLeaves(const google::protobuf::Descriptor& message, const std::string& path, std::set<std::string>& leaves) {
  for (int i = 0; i < message.field_count(); ++i) {
    const auto& field = *message.field(i);
    if (field.message_type() == v1::Contour::descriptor())
      AddLeaves(*field.message_type(), path + field.name() + ".", leaves);
    else
      leaves.insert(path + field.name());
  }
}

v1::SolveOptions Parse(std::vector<std::string> words) {
  words.insert(words.begin(), {"dlcs", "solve", "p.json"});
  std::vector<const char*> arguments;
  for (const std::string& word : words) arguments.push_back(word.c_str());
  const ParsedCommandLine parsed = ParseCommandLine(static_cast<int>(arguments.size()), arguments.data());
  const auto* command = std::get_if<SolveCommand>(&parsed);
  EXPECT_NE(command, nullptr) << ::testing::PrintToString(words);
  return command == nullptr ? v1::SolveOptions() : command->options;
}

TEST(SolveOptionTableTest, HasARowForEachField) {
  std::set<std::string> fields, rows;
  AddLeaves(*v1::SolveOptions::descriptor(), "", fields);
  for (const SolveOption& row : SolveOptionTable()) {
    EXPECT_TRUE(rows.insert(std::string(row.field)).second) << row.field;
    EXPECT_EQ(FlagOf(row.field), row.flag);
  }
  EXPECT_EQ(fields.erase("absolute_tolerance"), 1u);  // has the flag of absolute_tolerances
  EXPECT_EQ(rows, fields);
}

TEST(SolveOptionTableTest, WhatIsTypedSetsTheFieldsAndFollowsFromThem) {
  const std::vector<std::vector<std::string>> cases = {
      {"--method", "time-stepping", "--steps", "100", "--theta", "0.5", "--step-solver", "newton", "--average-y"},
      {"--tolerance", "1e-09", "--at", "0.1,0.5,2", "--max-memory", "1500000000", "--threads", "3"},
      {"--step", "0.01", "--no-estimate-error", "--iteration-tolerance", "1e-10", "--max-iterations", "20"},
      {"--grid", "0.25,1", "--window", "whole", "--windows-in-flight", "3", "--acceleration", "4", "--kernel",
       "contour"},
      {"--estimate-error", "--project-initial-state", "--inelastic-impact", "--window", "7"},
      {"--absolute-tolerance", "1e-09"},
      {"--absolute-tolerance", "0,iL=1e-06,v(a,b)=0.001,w(D1)=2"},
      {"--periodic", "0.02"},
      {"--periodic", "auto"},
      {"--interpolation", "cubic-spline", "--contour", "theorem-2-2", "--contour-nodes", "20", "--contour-gamma", "0.5",
       "--contour-mu", "3", "--contour-step", "0.25", "--contour-initial-state"}};
  for (const auto& words : cases) {
    const v1::SolveOptions options = Parse(words);
    EXPECT_EQ(AsTyped(options, ""), words);
    EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(Parse(AsTyped(options, "")), options));
  }
  EXPECT_THAT(AsTyped(v1::SolveOptions(), ""), IsEmpty());
  EXPECT_THAT(AsTyped(Parse({"--grid", "0.25,1"}), "nodes.txt"), ElementsAre("--grid", "nodes.txt"));
}

TEST(SolveOptionTableTest, SaysWhichOptionsHadNoEffect) {
  const v1::SolveOptions options =
      Parse({"--theta", "0.5", "--contour-nodes", "20", "--inelastic-impact", "--steps", "10"});
  EXPECT_THAT(OptionsWithoutEffect(options, v1::METHOD_TIME_STEPPING, false),
              ElementsAre("--contour-nodes had no effect: it is for wu-chen-iteration, and time-stepping solved"));
  EXPECT_THAT(OptionsWithoutEffect(options, v1::METHOD_UNSPECIFIED, true),
              ElementsAre("--inelastic-impact had no effect: it is for linear systems"));
}

}  // namespace
}  // namespace dlcs::client

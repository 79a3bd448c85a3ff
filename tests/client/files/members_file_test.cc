// SPDX-License-Identifier: Apache-2.0
#include "client/files/members_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

std::string WhyNot(const std::string& text) {
  return std::string(ParseMembers(text, "m.json", 2, 1).status().message());
}

TEST(MembersFileTest, ReadsWhatAMemberHasAndNothingElse) {
  const auto members = ParseMembers(
      R"([{"x0": [1, 2], "label": "first"}, {}, {"f": ["t", 2], "T": 3, "break_points": [1]},
          {"pieces": [{"t0": 0, "g": [1]}, {"t0": 1}]}])",
      "m.json", 2, 1);
  ASSERT_TRUE(members.ok()) << members.status();
  ASSERT_EQ(members->size(), 4U);
  EXPECT_THAT((*members)[0].x0(), ElementsAre(1, 2));
  EXPECT_EQ((*members)[0].label(), "first");
  EXPECT_EQ((*members)[1].ByteSizeLong(), 0U);
  EXPECT_TRUE((*members)[2].has_f() && !(*members)[2].has_g());
  EXPECT_EQ((*members)[2].horizon(), 3);
  EXPECT_THAT((*members)[2].break_points().times(), ElementsAre(1));
  EXPECT_TRUE((*members)[3].has_f() && (*members)[3].has_g());
  EXPECT_EQ((*members)[3].g().pieces_size(), 2);
  EXPECT_EQ((*members)[3].f().pieces(0).constant().values_size(), 2);  // zero
}

TEST(MembersFileTest, ReadsAnObjectWithTheList) {
  const auto members = ParseMembers(R"({"about": "one", "members": [{"T": 2}]})", "m.json", 2, 1);
  ASSERT_TRUE(members.ok()) << members.status();
  EXPECT_EQ((*members)[0].horizon(), 2);
}

TEST(MembersFileTest, ReadsATableOfInitialStates) {
  for (const char* text : {"x1,x2\n1,2\n\n-3e-1, 4\n", "1,2\r\n-0.3,4"}) {
    const auto members = ParseMembers(text, "m.csv", 2, 1);
    ASSERT_TRUE(members.ok()) << members.status();
    ASSERT_EQ(members->size(), 2U);
    EXPECT_THAT((*members)[0].x0(), ElementsAre(1, 2));
    EXPECT_THAT((*members)[1].x0(), ElementsAre(-0.3, 4));
  }
  EXPECT_THAT(WhyNot("1,2\n3,four\n"), HasSubstr("m.json, line 2: is not an initial state"));
  // Not the names of columns.
  for (const char* first : {"1 2", "-1;2", "x1,2.5a", ".5 1"}) {
    EXPECT_THAT(WhyNot(std::string(first) + "\n3,4\n"), HasSubstr("m.json, line 1: is not an initial state")) << first;
  }
}

TEST(MembersFileTest, TakesNoColumnForAnotherState) {
  const auto why_not = [](const std::string& text) {
    return std::string(ParseMembers(text, "m.csv", 2, 1, {"height", "speed"}).status().message());
  };
  EXPECT_EQ(why_not("height, speed\n1,2\n"), "");
  EXPECT_EQ(why_not("\"height\",\"speed\"\r\n1,2\n"), "");
  EXPECT_EQ(why_not("x1,x2\n1,2\n"), "");
  for (const std::string names : {"speed, height", "x2, x1", "height", "height, speed, force"}) {
    EXPECT_EQ(why_not(names + "\n1,2\n"), "m.csv, line 1: the columns are " + names +
                                              "; must be the states in their order, height, speed, or leave this line "
                                              "out");
  }
}

TEST(MembersFileTest, NamesMemberAndPlaceOfEveryMistake) {
  EXPECT_THAT(
      WhyNot(R"([{"x0": ["a"]}, {"X0": [1]}, 7, {"label": 1}])"),
      AllOf(HasSubstr("m.json: members[0]: x0[0]"), HasSubstr("m.json: members[1]: \"X0\""), HasSubstr("did you mean"),
            HasSubstr("m.json: members[2]: is a number"), HasSubstr("members[3]: label")));
  EXPECT_THAT(WhyNot(R"({"member": []})"), HasSubstr("\"members\""));
  EXPECT_THAT(WhyNot(R"({"members": 3})"), HasSubstr("must be a list of objects"));
  EXPECT_THAT(WhyNot(R"({"A": [[-1]], "B": [[1]], "N": [[1]], "M": [[1]], "x0": [0], "T": 1})"),
              AllOf(HasSubstr("m.json: holds a system of differential equations"),
                    HasSubstr("members are expected here"), Not(HasSubstr("is not a known key"))));
  EXPECT_THAT(WhyNot(R"([{"name": "first"}])"), HasSubstr("\"name\" is not a known key in a member"));
  EXPECT_TRUE(ParseMembers(R"({"$schema": "members.schema.json", "members": [{}]})", "m.json", 2, 1).ok());
  EXPECT_THAT(WhyNot("[{]"), HasSubstr("m.json, line 1, column 3"));
}

}  // namespace
}  // namespace dlcs::client

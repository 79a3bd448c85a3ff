// SPDX-License-Identifier: Apache-2.0
#include "client/local/mesh_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace dlcs::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A square of two triangles; its left edge is "the wall". Node 9 lies apart, as centers of arcs do.
constexpr const char* kOld = R"($MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
1 3 "the wall"
2 5 "body"
$EndPhysicalNames
$Nodes
5
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1e0 0
9 0.5 0.5 0
$EndNodes
$NodeData
1 "a view" 3 0.5
$EndNodeData
$Elements
4
1 15 2 0 1 1
2 1 2 3 4 4 1
3 2 2 5 6 1 2 3
4 2 2 5 6 1 3 4
$EndElements
)";

constexpr const char* kNew = R"($MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
1 3 "the wall"
2 5 "body"
$EndPhysicalNames
$Entities
1 1 1 0
1 0 0 0 0
4 0 0 0 0 1 0 1 -3 2 1 -2
6 0 0 0 1 1 0 1 5 1 4
$EndEntities
$Nodes
2 5 1 9
0 1 0 1
1
0 0 0
2 6 1 4
2
3
4
9
1 0 0 0.1 0.1
1 1 0 0.1 0.1
0 1e0 0 0.1 0.1
0.5 0.5 0 0.1 0.1
$EndNodes
$Elements
3 4 1 4
0 1 15 1
1 1
1 4 1 1
2 4 1
2 6 2 2
3 1 2 3
4 1 3 4
$EndElements
)";

TEST(MeshFileTest, BothVersionsHoldTheSameMesh) {
  for (const char* text : {kOld, kNew}) {
    const auto mesh = ParseMesh(text, "square.msh");
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->dimension(), 2);
    EXPECT_THAT(mesh->numbers, ElementsAre(1, 2, 3, 4, 9));
    EXPECT_EQ(mesh->points.col(3), (Vector{{0, 1, 0}}));
    ASSERT_EQ(mesh->elements.size(), 4u);
    EXPECT_EQ(mesh->elements[0].dimension, 0);
    EXPECT_THAT(mesh->elements[0].groups, IsEmpty());
    EXPECT_THAT(mesh->elements[1].groups, ElementsAre(3));
    EXPECT_THAT(mesh->elements[3].groups, ElementsAre(5));
    EXPECT_THAT(mesh->elements[3].nodes, ElementsAre(0, 2, 3, 0));
    EXPECT_EQ(mesh->elements[3].number, 4);
    ASSERT_EQ(mesh->groups.size(), 2u);
    EXPECT_EQ(mesh->groups[0].name, "the wall");
    EXPECT_EQ(mesh->groups[0].dimension, 1);
  }
}

// `from` replaced by `to`, once.
std::string ErrorOf(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  const auto mesh = ParseMesh(text, "m.msh");
  return mesh.ok() ? "no error" : std::string(mesh.status().message());
}

TEST(MeshFileTest, SaysWhereAndWhatIsWrong) {
  EXPECT_THAT(ErrorOf(kOld, "2.2 0", "2.2 1"), HasSubstr("m.msh:2: a binary file; must be ASCII"));
  EXPECT_THAT(ErrorOf(kOld, "2.2 0", "4 0"), HasSubstr("m.msh:2: version \"4\" of MSH; must be 2.2 or 4.1"));
  EXPECT_THAT(ErrorOf(kOld, "$MeshFormat", "{}"), HasSubstr("m.msh:1: \"{}\"; must be $MeshFormat"));
  EXPECT_THAT(ErrorOf(kOld, "1e0", "x"), HasSubstr("m.msh:14: \"x\"; must be a coordinate"));
  EXPECT_THAT(ErrorOf(kOld, "1e0", "inf"), HasSubstr("must be a coordinate, finite"));
  EXPECT_THAT(ErrorOf(kOld, "4 0 1e0", "3 0 1e0"), HasSubstr("a second node 3"));
  EXPECT_THAT(ErrorOf(kOld, "1 3 4\n", "1 3 44\n"), HasSubstr("element 4 has the node 44, which there is not"));
  EXPECT_THAT(ErrorOf(kOld, "3 2 2 5", "3 9 2 5"), HasSubstr("element type 9, a triangle of order 2; must be"));
  EXPECT_THAT(ErrorOf(kOld, "3 2 2 5", "3 77 2 5"), HasSubstr("element type 77; must be"));
  EXPECT_THAT(ErrorOf(kOld, "$Nodes\n5", "$Nodes\n999999999"), HasSubstr("the file has no room for as many"));
  EXPECT_THAT(ErrorOf(kOld, "$Nodes\n5", "$Nodes\n-5"), HasSubstr("must be the number of nodes"));
  EXPECT_THAT(ErrorOf(kOld, "$Nodes\n5", "$Nodes\n4"), HasSubstr("\"9\"; must be $EndNodes"));
  EXPECT_THAT(ErrorOf(kOld, "\"the wall\"", "the wall"), HasSubstr("m.msh:6: no name of a group in quotes"));
  EXPECT_THAT(ErrorOf(kOld, "$EndElements\n", ""), HasSubstr("$EndElements"));
  EXPECT_THAT(ErrorOf(kOld, "$EndNodeData\n", ""), HasSubstr("the file ends without $EndNodeData"));
  EXPECT_THAT(ErrorOf(kNew, "$Nodes", "$Nope"), HasSubstr("$EndNope"));
  EXPECT_THAT(ErrorOf(kNew, "2 6 1 4", "2 6 1 400"), HasSubstr("m.msh:"));
}

TEST(MeshFileTest, EveryPrefixIsRefusedOrWhole) {
  for (const std::string text : {kOld, kNew}) {
    for (std::size_t length = 0; length + 1 < text.size(); ++length) {
      EXPECT_FALSE(ParseMesh(text.substr(0, length), "m.msh").ok()) << length;
    }
  }
}

}  // namespace
}  // namespace dlcs::client

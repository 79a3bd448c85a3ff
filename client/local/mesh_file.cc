// SPDX-License-Identifier: Apache-2.0
#include "client/local/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

namespace dlcs::client {
namespace {

// Reads words and numbers one after the other. After the first error nothing more is read, and every number is 0.
class MeshReader {
 public:
  MeshReader(std::string_view text, const std::string& source) : text_(text), source_(source) {}

  const absl::Status& status() const { return status_; }
  bool ok() const { return status_.ok(); }

  void Refuse(const std::string& rule) {
    if (ok()) status_ = absl::InvalidArgumentError(fmt::format("{}:{}: {}", source_, line_, rule));
  }

  // The next word; empty at the end of the file.
  std::string_view Word() {
    SkipSpace();
    const std::size_t begin = at_;
    while (at_ < text_.size() && !IsSpace(text_[at_])) ++at_;
    return ok() ? text_.substr(begin, at_ - begin) : std::string_view();
  }

  template <typename Number>
  Number Take(const char* what) {
    const std::string_view word = Word();
    Number number{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || end != word.data() + word.size()) {
      Refuse(word.empty() ? fmt::format("the file ends where {} should be", what)
                          : fmt::format("\"{}\"; must be {}", word.substr(0, 40), what));
      return {};
    }
    return number;
  }
  std::int64_t Whole(const char* what) { return Take<std::int64_t>(what); }
  double Finite(const char* what) {
    const double number = Take<double>(what);
    if (!std::isfinite(number)) Refuse(fmt::format("{}; must be {}, finite", number, what));
    return std::isfinite(number) ? number : 0;
  }
  // A number of things, of which each takes two characters at least.
  std::int64_t Count(const char* what) {
    const std::int64_t count = Whole(what);
    const auto left = static_cast<std::int64_t>(text_.size() - at_);
    if (ok() && (count < 0 || count > left / 2 + 1)) {
      Refuse(fmt::format("{}; must be {}, and the file has no room for as many", count, what));
    }
    return ok() ? count : 0;
  }
  void SkipWords(std::int64_t count) {
    for (std::int64_t k = 0; k < count && ok(); ++k) {
      if (Word().empty()) Refuse("the file ends inside a section");
    }
  }

  // The rest of the text up to the next quote, after one.
  std::string Quoted(const char* what) {
    SkipSpace();
    const std::size_t end = at_ < text_.size() && text_[at_] == '"' ? text_.find_first_of("\"\n", at_ + 1) : text_.npos;
    if (end == text_.npos || text_[end] != '"') {
      Refuse(fmt::format("no {} in quotes", what));
      return "";
    }
    const std::string name(text_.substr(at_ + 1, end - at_ - 1));
    at_ = end + 1;
    return name;
  }

  void Expect(std::string_view wanted) {
    const std::string_view word = Word();
    if (word != wanted) Refuse(fmt::format("\"{}\"; must be {}", word.substr(0, 40), wanted));
  }

  // Skips the rest of the section and the line that ends it.
  void SkipSection(std::string_view name) {
    const std::string end = fmt::format("$End{}", name);
    while (ok()) {
      const std::string_view word = Word();
      if (word == end) return;
      if (word.empty()) Refuse(fmt::format("the file ends without {}", end));
    }
  }

 private:
  static bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
  void SkipSpace() {
    for (; at_ < text_.size() && IsSpace(text_[at_]); ++at_) line_ += text_[at_] == '\n';
  }

  std::string_view text_;
  const std::string& source_;
  std::size_t at_ = 0;
  int line_ = 1;
  absl::Status status_;
};

// The dimension of a type of elements: a point, a line, a triangle or a tetrahedron; refused if it is another one.
std::optional<int> DimensionOf(std::int64_t type, MeshReader& reader) {
  switch (type) {
    case 15:
      return 0;
    case 1:
      return 1;
    case 2:
      return 2;
    case 4:
      return 3;
    default:
      break;
  }
  static const std::map<std::int64_t, const char*> kNames = {{3, "a quadrangle"},
                                                             {5, "a hexahedron"},
                                                             {6, "a prism"},
                                                             {7, "a pyramid"},
                                                             {8, "a line of order 2"},
                                                             {9, "a triangle of order 2"},
                                                             {11, "a tetrahedron of order 2"}};
  const auto name = kNames.find(type);
  reader.Refuse(
      fmt::format("element type {}{}; must be a point, line, triangle or tetrahedron of order 1 (15, 1, 2, 4)", type,
                  name == kNames.end() ? "" : fmt::format(", {}", name->second)));
  return std::nullopt;
}

class MeshParser {
 public:
  MeshParser(std::string_view text, const std::string& source) : reader_(text, source) {}

  absl::StatusOr<Mesh> Parse() {
    reader_.Expect("$MeshFormat");
    const std::string version(reader_.Word());
    const bool is_old = version == "2.2";
    if (!is_old && version != "4.1") {
      reader_.Refuse(
          fmt::format("version \"{}\" of MSH; must be 2.2 or 4.1 (gmsh -save -format msh41)", version.substr(0, 40)));
    }
    if (reader_.Whole("0, for ASCII") != 0) reader_.Refuse("a binary file; must be ASCII (Mesh.Binary = 0 in Gmsh)");
    reader_.SkipSection("MeshFormat");
    bool has_nodes = false, has_elements = false;
    while (reader_.ok()) {
      const std::string_view word = reader_.Word();
      if (word.empty()) break;
      if (!word.starts_with('$')) {
        reader_.Refuse(fmt::format("\"{}\"; must be a section, as $Nodes", word.substr(0, 40)));
        break;
      }
      const std::string_view section = word.substr(1);
      if (section == "PhysicalNames") {
        ReadNames();
      } else if (section == "Entities" && !is_old) {
        ReadEntities();
      } else if (section == "Nodes" && !has_nodes) {
        has_nodes = true;
        is_old ? ReadOldNodes() : ReadNodes();
      } else if (section == "Elements" && has_nodes && !has_elements) {
        has_elements = true;
        is_old ? ReadOldElements() : ReadElements();
      } else if (section == "Nodes" || section == "Elements") {
        reader_.Refuse(has_nodes ? fmt::format("a second {}", word) : "$Elements before $Nodes");
      } else {
        reader_.SkipSection(section);
        continue;
      }
      reader_.Expect(fmt::format("$End{}", section));
    }
    if (!has_nodes || !has_elements) reader_.Refuse(has_nodes ? "no $Elements" : "no $Nodes");
    if (!reader_.ok()) return reader_.status();
    mesh_.points = Eigen::Map<const Matrix>(coordinates_.data(), 3, static_cast<Index>(coordinates_.size() / 3));
    return std::move(mesh_);
  }

 private:
  void ReadNames() {
    const std::int64_t count = reader_.Count("the number of names");
    for (std::int64_t k = 0; k < count && reader_.ok(); ++k) {
      Mesh::Group group;
      group.dimension = static_cast<int>(reader_.Whole("the dimension of a group"));
      group.tag = reader_.Take<int>("the number of a group");
      group.name = reader_.Quoted("name of a group");
      mesh_.groups.push_back(std::move(group));
    }
  }

  // The physical groups of each entity; of all else only the numbers are counted.
  void ReadEntities() {
    std::array<std::int64_t, 4> counts;
    for (std::int64_t& count : counts) count = reader_.Count("the number of entities");
    for (int dimension = 0; dimension < 4; ++dimension) {
      for (std::int64_t k = 0; k < counts[static_cast<std::size_t>(dimension)] && reader_.ok(); ++k) {
        const int tag = reader_.Take<int>("the number of an entity");
        reader_.SkipWords(dimension == 0 ? 3 : 6);  // a point, or a box
        std::vector<int>& groups = groups_of_[{dimension, tag}];
        const std::int64_t groups_count = reader_.Count("the number of physical groups");
        for (std::int64_t i = 0; i < groups_count && reader_.ok(); ++i) {
          groups.push_back(std::abs(reader_.Take<int>("the number of a group")));  // negative: turned round
        }
        if (dimension > 0) reader_.SkipWords(reader_.Count("the number of entities around"));
      }
    }
  }

  void AddNode(std::int64_t number, double x, double y, double z) {
    if (!reader_.ok()) return;
    if (!index_of_.emplace(number, static_cast<Index>(mesh_.numbers.size())).second) {
      return reader_.Refuse(fmt::format("a second node {}", number));
    }
    mesh_.numbers.push_back(number);
    coordinates_.insert(coordinates_.end(), {x, y, z});
  }

  void ReadOldNodes() {
    const std::int64_t count = reader_.Count("the number of nodes");
    for (std::int64_t k = 0; k < count && reader_.ok(); ++k) {
      const std::int64_t number = reader_.Whole("the number of a node");
      const double x = reader_.Finite("a coordinate"), y = reader_.Finite("a coordinate");
      AddNode(number, x, y, reader_.Finite("a coordinate"));
    }
  }

  void ReadNodes() {
    const std::int64_t blocks = reader_.Count("the number of blocks");
    reader_.SkipWords(3);  // nodes in all, the least and the largest number
    for (std::int64_t block = 0; block < blocks && reader_.ok(); ++block) {
      const std::int64_t dimension = reader_.Whole("a dimension");
      reader_.SkipWords(1);
      const bool is_parametric = reader_.Whole("0 or 1, for parameters") != 0;
      const std::int64_t count = reader_.Count("the number of nodes");
      std::vector<std::int64_t> numbers;
      for (std::int64_t k = 0; k < count && reader_.ok(); ++k) numbers.push_back(reader_.Whole("the number of a node"));
      for (const std::int64_t number : numbers) {
        const double x = reader_.Finite("a coordinate"), y = reader_.Finite("a coordinate");
        AddNode(number, x, y, reader_.Finite("a coordinate"));
        if (is_parametric) reader_.SkipWords(dimension);
      }
    }
  }

  void AddElement(std::int64_t number, int dimension, std::vector<int> groups) {
    Mesh::Element element{.dimension = dimension, .groups = std::move(groups), .number = number};
    for (int k = 0; k <= dimension && reader_.ok(); ++k) {
      const std::int64_t node = reader_.Whole("a node of the element");
      const auto found = index_of_.find(node);
      if (found == index_of_.end())
        return reader_.Refuse(fmt::format("element {} has the node {}, which there is not", number, node));
      element.nodes[static_cast<std::size_t>(k)] = found->second;
    }
    if (reader_.ok()) mesh_.elements.push_back(std::move(element));
  }

  void ReadOldElements() {
    const std::int64_t count = reader_.Count("the number of elements");
    for (std::int64_t k = 0; k < count && reader_.ok(); ++k) {
      const std::int64_t number = reader_.Whole("the number of an element");
      const auto dimension = DimensionOf(reader_.Whole("the type of an element"), reader_);
      const std::int64_t tags = reader_.Count("the number of tags");
      std::vector<int> groups;
      if (tags > 0) {
        const int group = reader_.Take<int>("a physical group");
        if (group != 0) groups.push_back(group);
        reader_.SkipWords(tags - 1);
      }
      if (reader_.ok()) AddElement(number, *dimension, std::move(groups));
    }
  }

  void ReadElements() {
    const std::int64_t blocks = reader_.Count("the number of blocks");
    reader_.SkipWords(3);
    for (std::int64_t block = 0; block < blocks && reader_.ok(); ++block) {
      const int of_entity = reader_.Take<int>("a dimension");
      const int entity = reader_.Take<int>("the number of an entity");
      const auto dimension = DimensionOf(reader_.Whole("the type of an element"), reader_);
      const std::int64_t count = reader_.Count("the number of elements");
      const auto groups = groups_of_.find({of_entity, entity});
      for (std::int64_t k = 0; k < count && reader_.ok(); ++k) {
        const std::int64_t number = reader_.Whole("the number of an element");
        AddElement(number, *dimension, groups == groups_of_.end() ? std::vector<int>() : groups->second);
      }
    }
  }

  MeshReader reader_;
  Mesh mesh_;
  std::vector<double> coordinates_;
  std::unordered_map<std::int64_t, Index> index_of_;           // of nodes, by number
  std::map<std::pair<int, int>, std::vector<int>> groups_of_;  // by dimension and number of an entity
};

}  // namespace

absl::StatusOr<Mesh> ParseMesh(std::string_view text, const std::string& source) {
  return MeshParser(text, source).Parse();
}

}  // namespace dlcs::client

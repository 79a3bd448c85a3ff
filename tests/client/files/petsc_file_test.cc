// SPDX-License-Identifier: Apache-2.0
#include "client/files/petsc_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <string>

#include "client/files/array_file.h"

namespace dlcs::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string BigWords(std::initializer_list<std::uint32_t> words) {
  std::string bytes;
  for (const std::uint32_t word : words) {
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(word >> shift & 0xff);
  }
  return bytes;
}

std::string BigDoubles(std::initializer_list<double> values) {
  std::string bytes;
  for (const double value : values) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (int shift = 56; shift >= 0; shift -= 8) bytes += static_cast<char>(bits >> shift & 0xff);
  }
  return bytes;
}

// [1.5, 0, -2; 0, 0, 0; 0, 4, 0] as MatView() writes it.
std::string PetscMatrix(double last = 4) {
  return BigWords({1211216, 3, 3, 3, 2, 0, 1, 0, 2, 1}) + BigDoubles({1.5, -2, last});
}

absl::StatusOr<StoredArray> PetscOf(const std::string& bytes) {
  ReadingBudget budget;
  return ParsePetsc(bytes, budget);
}

std::string PetscRefusalOf(const std::string& bytes) {
  const auto array = PetscOf(bytes);
  EXPECT_FALSE(array.ok());
  return std::string(array.status().message());
}

TEST(PetscFileTest, KnowsThePlacesOfAMatrixThatNobodyReadsWhole) {
  const auto head = ParsePetscHead(BigWords({1211216, 2147483647, 5, 2147483647, 1}));
  ASSERT_TRUE(head.ok()) << head.status();
  EXPECT_EQ(head->rows, 2147483647);
  EXPECT_EQ(head->columns, 5);
  EXPECT_EQ(head->columns_at(), 16 + 4 * std::uint64_t{2147483647});
  EXPECT_EQ(head->values_at(), 16 + 8 * std::uint64_t{2147483647});
  EXPECT_EQ(head->file_bytes(), 16 + 16 * std::uint64_t{2147483647});
  EXPECT_FALSE(ParsePetscHead(BigWords({1211214, 3, 0, 0})).ok());  // a vector
  EXPECT_FALSE(ParsePetscHead(BigWords({1211216, 3})).ok());
}

TEST(PetscFileTest, ReadsASparseMatrix) {
  const auto array = PetscOf(PetscMatrix());
  ASSERT_TRUE(array.ok()) << array.status();
  const v1::SparseMatrix& matrix = array->matrix.sparse();
  EXPECT_EQ(matrix.rows(), 3);
  EXPECT_EQ(matrix.columns(), 3);
  EXPECT_THAT(matrix.row_indices(), ElementsAre(0, 0, 2));
  EXPECT_THAT(matrix.column_indices(), ElementsAre(0, 2, 1));
  EXPECT_THAT(matrix.values(), ElementsAre(1.5, -2, 4));
}

TEST(PetscFileTest, ReadsAVector) {
  const auto array = PetscOf(BigWords({1211214, 2}) + BigDoubles({0.25, -3}));
  ASSERT_TRUE(array.ok()) << array.status();
  EXPECT_EQ(array->dimensions, 1);
  EXPECT_THAT(array->matrix.dense().values(), ElementsAre(0.25, -3));
}

TEST(PetscFileTest, IsKnownByItsContent) {
  EXPECT_TRUE(IsArrayFile(PetscMatrix()));
  EXPECT_FALSE(IsPetscFile("{}"));
  EXPECT_FALSE(IsPetscFile(""));
}

TEST(PetscFileTest, RefusesWhatIsDamagedOrOfAnotherKind) {
  const std::string whole = PetscMatrix();
  for (std::size_t size = 4; size < whole.size(); ++size) {
    EXPECT_THAT(PetscRefusalOf(whole.substr(0, size)), HasSubstr("ends before")) << size;
  }
  EXPECT_THAT(PetscRefusalOf(whole + "x"), HasSubstr("1 bytes more"));
  EXPECT_THAT(PetscRefusalOf(whole + whole), HasSubstr("more than one matrix"));
  EXPECT_THAT(PetscRefusalOf(PetscMatrix(std::numeric_limits<double>::quiet_NaN())), HasSubstr("row 2, column 1"));
  EXPECT_THAT(PetscRefusalOf(BigWords({1211216, 1, 2, 1, 1, 2}) + BigDoubles({1})), HasSubstr("column 2 (from 0)"));
  EXPECT_THAT(PetscRefusalOf(BigWords({1211216, 1, 2, 1, 0, 1}) + BigDoubles({1})), HasSubstr("do not add up"));
  EXPECT_THAT(PetscRefusalOf(BigWords({1211216, 1, 2, 1, 0xffffffff, 1}) + BigDoubles({1})), HasSubstr("do not add"));
  EXPECT_THAT(PetscRefusalOf(BigWords({1211216, 0, 2, 0})), HasSubstr("is of 0 x 2"));
  EXPECT_THAT(PetscRefusalOf(BigWords({1211216, 1, 1, 0xffffffff}) + BigDoubles({1})), HasSubstr("dense matrix"));
  EXPECT_THAT(PetscRefusalOf(BigWords({0, 1211216, 0, 3, 0, 3, 0, 3})), HasSubstr("64 bits"));
  EXPECT_THAT(PetscRefusalOf("PK"), HasSubstr("not a PETSc matrix or vector"));
  ReadingBudget little(8);
  EXPECT_FALSE(ParsePetsc(whole, little).ok());
}

}  // namespace
}  // namespace dlcs::client

// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/atomic_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

namespace dlcs::client {
namespace {

namespace fs = std::filesystem;

class AtomicFileTest : public ::testing::Test {
 protected:
  AtomicFileTest()
      : folder_(fs::path(::testing::TempDir()) / ::testing::UnitTest::GetInstance()->current_test_info()->name()) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~AtomicFileTest() override { fs::remove_all(folder_); }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  std::string Content(const std::string& name) const {
    std::ifstream stream(Path(name));
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  auto Entries() const { return std::distance(fs::directory_iterator(folder_), fs::directory_iterator()); }

  fs::path folder_;
};

TEST_F(AtomicFileTest, KeepsTheOldContentUntilItIsCommitted) {
  std::ofstream(Path("out")) << "old";
  auto file = AtomicFile::Create(Path("out"));
  ASSERT_TRUE(file.ok()) << file.status();
  std::fputs("new", (*file)->stream());
  EXPECT_EQ(Content("out"), "old");
  EXPECT_TRUE((*file)->Commit().ok());
  EXPECT_EQ(Content("out"), "new");
  EXPECT_EQ(Entries(), 1);
}

TEST_F(AtomicFileTest, LeavesNothingBehindWithoutACommit) {
  { ASSERT_TRUE(AtomicFile::Create(Path("out")).ok()); }
  EXPECT_EQ(Entries(), 0);
}

TEST_F(AtomicFileTest, ReplacesTheTargetOfALink) {
  std::ofstream(Path("target")) << "old";
  fs::create_symlink("target", Path("link"));
  auto file = AtomicFile::Create(Path("link"));
  ASSERT_TRUE(file.ok()) << file.status();
  std::fputs("new", (*file)->stream());
  EXPECT_TRUE((*file)->Commit().ok());
  EXPECT_TRUE(fs::is_symlink(Path("link")));
  EXPECT_EQ(Content("target"), "new");
}

TEST_F(AtomicFileTest, WritesIntoAPipeAndLeavesIt) {
  for (const bool whole : {true, false}) {
    const std::string pipe = Path(whole ? "pipe" : "other");
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    fs::create_symlink(fs::path(pipe).filename(), pipe + ".link");
    std::string read;
    std::thread reader([&] {
      std::ifstream stream(pipe);
      read.assign(std::istreambuf_iterator<char>(stream), {});
    });
    {
      auto file = AtomicFile::Create(pipe + ".link");
      ASSERT_TRUE(file.ok()) << file.status();
      std::fputs("new", (*file)->stream());
      EXPECT_TRUE((whole ? (*file)->Commit() : (*file)->CommitPartial()).ok());
    }
    reader.join();
    EXPECT_EQ(read, "new");
    EXPECT_TRUE(fs::is_fifo(pipe));
  }
  EXPECT_EQ(Entries(), 4);
}

TEST_F(AtomicFileTest, ReportsThatAPipeHasNoReaderAnyMore) {
  const auto before = std::signal(SIGPIPE, SIG_IGN);
  ASSERT_EQ(mkfifo(Path("pipe").c_str(), 0600), 0);
  const int reader = open(Path("pipe").c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  auto file = AtomicFile::Create(Path("pipe"));
  close(reader);
  ASSERT_TRUE(file.ok()) << file.status();
  std::fputs("lost", (*file)->stream());
  EXPECT_THAT(std::string((*file)->Commit().message()), ::testing::HasSubstr("Broken pipe"));
  file->reset();
  std::signal(SIGPIPE, before);
  EXPECT_TRUE(fs::is_fifo(Path("pipe")));
  EXPECT_EQ(Entries(), 1);
}

TEST_F(AtomicFileTest, RefusesPlacesWhereNoFileCanBe) {
  for (const std::string& path : {Path("no/such/folder/out"), folder_.string()}) {
    const auto file = AtomicFile::Create(path);
    EXPECT_EQ(file.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(file.status().message()), ::testing::HasSubstr(path));
  }
}

TEST_F(AtomicFileTest, NoticesLostOutput) {
  std::FILE* full = std::fopen("/dev/full", "w");
  ASSERT_NE(full, nullptr);
  std::fputs("lost", full);
  const absl::Status status = FlushStream(full, "the disk");
  std::fclose(full);
  EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("No space left"));
}

}  // namespace
}  // namespace dlcs::client

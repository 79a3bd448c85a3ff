// SPDX-License-Identifier: Apache-2.0
// Writes that share a transaction, and do not affect each other.
#include "server/store/sqlite/sqlite_database.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <functional>
#include <iterator>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/store/temporary_folder.h"

namespace dlcs::jobs {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

// https://www.sqlite.org/fileformat2.html#walformat: a frame that ends a transaction says how large the database is
// after it. Frames of an earlier round of the log have other salts.
int CommitsInLog(const std::string& path) {
  std::ifstream file(path + "-wal", std::ios::binary);
  const std::string log((std::istreambuf_iterator<char>(file)), {});
  const auto number = [&log](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t k = at; k < at + 4; ++k) value = value << 8 | static_cast<std::uint8_t>(log.at(k));
    return value;
  };
  if (log.size() < 32) return 0;
  int commits = 0;
  for (std::size_t frame = 32; frame + 24 <= log.size(); frame += 24 + number(8)) {
    if (number(frame + 8) == number(16) && number(frame + 12) == number(20) && number(frame + 4) > 0) ++commits;
  }
  return commits;
}

class SqliteDatabaseTest : public ::testing::Test {
 protected:
  using Write = std::function<absl::Status(SqliteConnection&)>;

  SqliteDatabaseTest() {
    EXPECT_TRUE(database_
                    .Write([](SqliteConnection& connection) {
                      connection.Execute("CREATE TABLE notes (text TEXT UNIQUE NOT NULL)");
                      return absl::OkStatus();
                    })
                    .ok());
  }

  static Write Add(const std::string& text) {
    return [text](SqliteConnection& connection) {
      connection.Run("INSERT INTO notes VALUES (?1)", text);
      return absl::OkStatus();
    };
  }
  int Count(const std::string& text) {
    return *database_.Read([&](SqliteConnection& connection) -> absl::StatusOr<int> {
      const auto query = connection.Prepare("SELECT count(*) FROM notes WHERE text = ?1");
      query->Bind(text);
      query->Step();
      return static_cast<int>(query->Int(0));
    });
  }

  struct Round {
    std::vector<absl::Status> statuses;  // of `writes`; INTERNAL with what they threw
    int commits = 0;                     // with that of the write they waited for
  };
  // `writes` at the same time, from a thread each, while another write is under way.
  Round WriteWhileBusy(const std::vector<Write>& writes, const std::string& first) {
    Round round{.statuses = std::vector<absl::Status>(writes.size())};
    const int before = CommitsInLog(path_);
    std::atomic<std::size_t> calling = 0;
    std::vector<std::thread> threads;
    const absl::Status status = database_.Write([&](SqliteConnection& connection) {
      for (std::size_t k = 0; k < writes.size(); ++k) {
        threads.emplace_back([&, k] {
          ++calling;
          try {
            round.statuses[k] = database_.Write(writes[k]);
          } catch (const std::exception& error) {
            round.statuses[k] = absl::InternalError(error.what());
          }
        });
      }
      while (calling < writes.size()) std::this_thread::yield();
      // Gives the threads time to reach the queue; there is no signal for it.
      std::this_thread::sleep_for(5ms);
      return Add(first)(connection);
    });
    EXPECT_TRUE(status.ok()) << status;
    for (std::thread& thread : threads) thread.join();
    round.commits = CommitsInLog(path_) - before;
    return round;
  }

  testing::TemporaryFolder folder_;
  const std::string path_ = folder_.File("notes.db");
  SqliteDatabase database_{{.path = path_}};
};

TEST_F(SqliteDatabaseTest, WritesThatWaitAreCommittedTogether) {
  // On a busy machine a thread may be too late for the group, but not every time.
  for (int k = 0; k < 100; ++k) {
    const std::string text = std::to_string(k);
    const Round round = WriteWhileBusy({Add(text + "a"), Add(text + "b"), Add(text + "c"), Add(text + "d")}, text);
    for (const absl::Status& status : round.statuses) EXPECT_TRUE(status.ok()) << status;
    for (const char* letter : {"", "a", "b", "c", "d"}) EXPECT_EQ(Count(text + letter), 1);
    if (round.commits == 2) return;
  }
  FAIL() << "five writes are never two commits";
}

TEST_F(SqliteDatabaseTest, WhatOneWriteDoesWrongIsItsOwn) {
  const Write refuse = [](SqliteConnection& connection) {
    connection.Run("INSERT INTO notes VALUES ('refused')");
    return absl::NotFoundError("refused");
  };
  const Write fail = [](SqliteConnection& connection) {
    connection.Run("INSERT INTO notes VALUES ('failed')");
    connection.Execute("INSERT INTO notes VALUES ('failed')");  // breaks a rule of the table
    return absl::OkStatus();
  };
  const Write throws = [](SqliteConnection& connection) -> absl::Status {
    connection.Run("INSERT INTO notes VALUES ('thrown')");
    throw std::runtime_error("thrown");
  };
  for (int k = 0; k < 20; ++k) {
    const std::string text = std::to_string(k);
    // Without and with one that rolls all back.
    const bool with_failure = k % 2 == 1;
    const Round round =
        WriteWhileBusy({Add(text + "a"), refuse, throws, with_failure ? fail : Add(text + "c"), Add(text + "b")}, text);
    for (const char* letter : {"", "a", "b"}) EXPECT_EQ(Count(text + letter), 1);
    EXPECT_EQ(round.statuses[0], absl::OkStatus());
    EXPECT_EQ(round.statuses[1], absl::NotFoundError("refused"));
    EXPECT_EQ(round.statuses[2], absl::InternalError("thrown"));
    if (with_failure) {
      EXPECT_THAT(std::string(round.statuses[3].message()), HasSubstr("UNIQUE"));
    } else {
      EXPECT_EQ(round.statuses[3], absl::OkStatus());
    }
    EXPECT_EQ(round.statuses[4], absl::OkStatus());
    for (const char* undone : {"refused", "failed", "thrown"}) EXPECT_EQ(Count(undone), 0);
  }
}

}  // namespace
}  // namespace dlcs::jobs

// SPDX-License-Identifier: Apache-2.0
// A PostgreSQL server of a test's own, in a temporary folder, reached through a socket in it.

#ifndef DLCS_TESTS_SERVER_STORE_POSTGRES_POSTGRES_SERVER_H_
#define DLCS_TESTS_SERVER_STORE_POSTGRES_POSTGRES_SERVER_H_

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/server/store/temporary_folder.h"

namespace dlcs::jobs::testing {

// Throws std::runtime_error, with what the server said, where there is no PostgreSQL or it does not start. It refuses
// to run as root, and then runs as the user `postgres` (or `nobody`). Ends with the test, also with one that crashes.
class PostgresServer {
 public:
  // `settings` of postgresql.conf, as "fsync=on", beside or instead of those that make tests quick.
  explicit PostgresServer(std::vector<std::string> settings = {});
  ~PostgresServer();
  PostgresServer(const PostgresServer&) = delete;
  PostgresServer& operator=(const PostgresServer&) = delete;

  // The one that tests share which leave it as it is. Made when it is first asked for.
  static PostgresServer& Shared();

  // Of the database that is there from the start; of a schema of it, which is made, where one is named.
  std::string address() const;
  std::string AddressOf(const std::string& schema);
  // Runs `sql` as the database's owner.
  void Execute(const std::string& sql);

  void Start();
  // In an orderly way: sessions are ended, and what is in memory is written.
  void Stop();
  // kill -9 of the server's first process; the others notice and end.
  void Kill();
  // The server and all its sessions stand still, and hold on to their connections.
  void Freeze();
  void Thaw();

  // Of the server's first process.
  pid_t pid() const { return pid_; }
  std::filesystem::path data() const { return folder_.path() / "data"; }

 private:
  void Await();
  void SignalAll(int signal) const;

  const std::vector<std::string> settings_;
  TemporaryFolder folder_;
  pid_t pid_ = -1;
};

}  // namespace dlcs::jobs::testing

#endif  // DLCS_TESTS_SERVER_STORE_POSTGRES_POSTGRES_SERVER_H_

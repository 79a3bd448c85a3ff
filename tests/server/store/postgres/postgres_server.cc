// SPDX-License-Identifier: Apache-2.0
#include "tests/server/store/postgres/postgres_server.h"

#include <fcntl.h>
#include <pwd.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

#include "server/store/postgres/postgres.h"
#include "tests/support/paths.h"

extern char** environ;

namespace dlcs::jobs::testing {
namespace {

using namespace std::chrono_literals;

constexpr auto kPatience = 60s;

const passwd& UnprivilegedUser() {
  const passwd* user = getpwnam("postgres");
  if (user == nullptr) user = getpwnam("nobody");
  if (user == nullptr) throw std::runtime_error("PostgreSQL does not run as root, and there is no other user for it");
  return *user;
}

// `words` as a program that ends with this one.
pid_t Spawn(std::vector<std::string> words, const std::string& log) {
  words.insert(words.begin(), {"setpriv", "--pdeathsig", "QUIT"});
  if (geteuid() == 0) {
    const passwd& user = UnprivilegedUser();
    words.insert(words.begin() + 1,
                 {"--reuid", std::to_string(user.pw_uid), "--regid", std::to_string(user.pw_gid), "--clear-groups"});
  }
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  pid_t pid = -1;
  const int error = posix_spawnp(&pid, words[0].c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) throw std::runtime_error("cannot run setpriv (Debian package util-linux)");
  return pid;
}

std::string ContentOf(const std::string& file) {
  std::ostringstream content;
  content << std::ifstream(file).rdbuf();
  return content.str();
}

void Run(std::vector<std::string> words, const std::string& log) {
  const std::string program = words.front();
  int status = 0;
  waitpid(Spawn(std::move(words), log), &status, 0);
  if (status != 0) throw std::runtime_error(program + ": " + ContentOf(log));
}

// For the user as whom the programs of PostgreSQL run.
void HandOver(const TemporaryFolder& folder) {
  if (geteuid() != 0) return;
  const passwd& user = UnprivilegedUser();
  if (chown(folder.path().c_str(), user.pw_uid, user.pw_gid) != 0) throw std::runtime_error("chown");
}

// An empty database, made once for all servers of this process. With checksums, so that damage is found. The servers
// start on new files: nothing needs to reach the disk yet.
const TemporaryFolder& EmptyDatabase() {
  static const std::unique_ptr<const TemporaryFolder> made = [] {
    auto folder = std::make_unique<const TemporaryFolder>();
    HandOver(*folder);
    Run({dlcs::testing::PostgresFolder() + "/initdb", "--pgdata", folder->File("data"), "--username", "dlcs", "--auth",
         "trust", "--encoding", "UTF8", "--no-locale", "--no-sync", "--data-checksums"},
        folder->File("initdb.log"));
    return folder;
  }();
  return *made;
}

std::vector<pid_t> ChildrenOf(pid_t pid) {
  std::ifstream list("/proc/" + std::to_string(pid) + "/task/" + std::to_string(pid) + "/children");
  std::vector<pid_t> children;
  for (pid_t child = 0; list >> child;) children.push_back(child);
  return children;
}

}  // namespace

PostgresServer::PostgresServer(std::vector<std::string> settings) : settings_(std::move(settings)) {
  HandOver(folder_);
  Run({"cp", "-R", EmptyDatabase().File("data"), folder_.path().string()}, folder_.File("copy.log"));
  Start();
}

PostgresServer::~PostgresServer() {
  if (pid_ < 0) return;
  kill(pid_, SIGCONT);
  kill(pid_, SIGQUIT);
  waitpid(pid_, nullptr, 0);
}

PostgresServer& PostgresServer::Shared() {
  static PostgresServer server;
  return server;
}

std::string PostgresServer::address() const { return "postgresql://dlcs@/postgres?host=" + folder_.path().string(); }

std::string PostgresServer::AddressOf(const std::string& schema) {
  Execute("CREATE SCHEMA IF NOT EXISTS " + schema);
  return address() + "&options=-csearch_path%3D" + schema;
}

void PostgresServer::Execute(const std::string& sql) { PostgresConnection(address(), kPatience).Execute(sql); }

void PostgresServer::Start() {
  // Also a server that is killed has written what it acknowledges: only where the machine fails is more needed.
  std::vector<std::string> settings = {"listen_addresses=", "shared_buffers=16MB", "fsync=off"};
  settings.insert(settings.end(), settings_.begin(), settings_.end());  // the last one counts
  std::vector<std::string> words = {dlcs::testing::PostgresFolder() + "/postgres", "-D", data().string(), "-k",
                                    folder_.path().string()};
  for (const std::string& setting : settings) words.insert(words.end(), {"-c", setting});
  pid_ = Spawn(std::move(words), folder_.File("server.log"));
  Await();
}

void PostgresServer::Await() {
  std::string error;
  for (const auto end = std::chrono::steady_clock::now() + kPatience; std::chrono::steady_clock::now() < end;) {
    try {
      PostgresConnection(address(), kPatience).Run("SELECT 1");
      return;
    } catch (const PostgresError& not_yet) {
      error = not_yet.what();
    }
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == pid_) {
      // After a kill -9 the memory that its sessions shared must be gone first.
      if (ContentOf(folder_.File("server.log")).find("shared memory block") == std::string::npos) break;
      std::filesystem::remove(folder_.File("server.log"));
      std::this_thread::sleep_for(20ms);
      return Start();
    }
    std::this_thread::sleep_for(10ms);
  }
  throw std::runtime_error("PostgreSQL does not start: " + error + "\n" + ContentOf(folder_.File("server.log")));
}

void PostgresServer::Stop() {
  kill(pid_, SIGINT);
  waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

void PostgresServer::Kill() {
  // Its sessions would go on for as long as it takes them to notice.
  const auto sessions = ChildrenOf(pid_);
  kill(pid_, SIGKILL);
  for (const pid_t session : sessions) kill(session, SIGKILL);
  waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

void PostgresServer::SignalAll(int signal) const {
  for (const pid_t child : ChildrenOf(pid_)) kill(child, signal);
  kill(pid_, signal);
}

void PostgresServer::Freeze() { SignalAll(SIGSTOP); }

void PostgresServer::Thaw() { SignalAll(SIGCONT); }

}  // namespace dlcs::jobs::testing

// SPDX-License-Identifier: Apache-2.0
// Who may connect, who may call and what: real servers, real TLS, the real client.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include "client/rpc/client.h"
#include "grpcpp/generic/generic_stub.h"
#include "server/access/permissions.h"
#include "server/access/token.h"
#include "spdlog/spdlog.h"
#include "tests/server/access/all_methods.h"
#include "tests/server/dlcsd_process.h"
#include "tests/server/service_fixture.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_authority.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using client::Client;
using client::ConnectionOptions;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::AllOf;
using ::testing::ContainsRegex;
using testing::DlcsdProcess;
using ::testing::HasSubstr;
using testing::Issued;
using ::testing::Not;
using testing::ReplaceFile;
using testing::SwitchingRequest;

const std::string kAlice = "dlcs_token-of-alice", kBob = "dlcs_token-of-bob", kReader = "dlcs_token-of-a-reader",
                  kAdmin = "dlcs_token-of-an-admin";

std::string UserLines() {
  std::string lines;
  for (const auto& [name, right, token] :
       {std::tuple{"alice", "submitter", kAlice}, std::tuple{"bob", "submitter", kBob},
        std::tuple{"rita", "reader", kReader}, std::tuple{"ada", "admin", kAdmin}}) {
    lines += std::string(name) + " " + right + " " + TokenHashText(token) + "\n";
  }
  return lines;
}

// A server whose access settings each test chooses.
class SecureServerTest : public testing::ServiceTest {
 protected:
  void SetUp() override { spdlog::set_level(spdlog::level::off); }

  // Files that --tls-cert, --tls-key and so on name.
  AccessSettings Tls(const Issued& issued) {
    ReplaceFile(folder_.File("server.key"), issued.key);
    ReplaceFile(folder_.File("server.pem"), issued.certificate);
    AccessSettings access;
    access.tls_cert = folder_.File("server.pem");
    access.tls_key = folder_.File("server.key");
    return access;
  }
  AccessSettings WithUsers(AccessSettings access) {
    ReplaceFile(folder_.File("tokens.txt"), UserLines());
    access.tokens = folder_.File("tokens.txt");
    return access;
  }
  void Start(const AccessSettings& access, bool jobs = true) {
    ServerConfig config;
    config.access = access;
    if (jobs) config.store = folder_.File("jobs.db");
    config.checkpoint_ms = 20;
    StartServer(config);
  }

  ConnectionOptions Options(const std::string& token = "") {
    ConnectionOptions options(server_->address());
    options.token = token;
    return options;
  }
  // Trusts `authority`.
  ConnectionOptions Encrypted(const testing::TestAuthority& authority, const std::string& token = "") {
    ConnectionOptions options = Options(token);
    options.tls_ca = File("ca.pem", authority.certificate());
    return options;
  }
  ConnectionOptions Showing(const Issued& issued, ConnectionOptions options) {
    options.tls_cert = File("client.pem", issued.certificate);
    options.tls_key = File("client.key", issued.key);
    return options;
  }

  // The status of a call that every reader may make.
  static absl::Status Ask(const ConnectionOptions& options) {
    auto client = Client::Connect(options);
    if (!client.ok()) return client.status();
    return (*client)->GetCapabilities({.deadline = seconds(20), .stop = {}}).status();
  }
  static std::string Refusal(const ConnectionOptions& options) { return std::string(Ask(options).message()); }

  std::unique_ptr<Client> Jobs(const std::string& token) { return *Client::Connect(Options(token)); }
  static std::string Submit(Client& client, const v1::SolveRequest& solve, const std::string& request_id = "") {
    v1::CreateSolveJobRequest request;
    *request.mutable_solve() = solve;
    request.set_request_id(request_id);
    const auto job = client.jobs().Submit(request, {});
    EXPECT_TRUE(job.ok()) << job.status();
    return job.ok() ? job->name() : "";
  }
  static absl::Status Watch(Client& client, const std::string& name) {
    v1::WatchSolveJobRequest request;
    request.set_name(name);
    return client.jobs().Watch(request, [](const v1::SolveEvent&) {}, {.deadline = seconds(60), .stop = {}});
  }

  // Waits until `holds()`; false after a minute.
  static bool Becomes(const std::function<bool()>& holds) {
    for (int k = 0; k < 1200; ++k) {
      if (holds()) return true;
      std::this_thread::sleep_for(milliseconds(50));
    }
    return false;
  }

  std::string File(const std::string& name, const std::string& content) {
    ReplaceFile(folder_.File(name), content);
    return folder_.File(name);
  }

  jobs::testing::TemporaryFolder folder_;
  const testing::TestAuthority authority_, foreign_;
};

// An empty message to any method, as any program may send it.
grpc::Status CallRaw(const std::string& address, const std::string& path, const std::string& token) {
  grpc::GenericStub stub(testing::Connect(address));
  grpc::ClientContext context;
  testing::SetDeadline(context, milliseconds(20'000));
  if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
  grpc::CompletionQueue queue;
  const grpc::Slice nothing("");
  const grpc::ByteBuffer request(&nothing, 1);
  grpc::ByteBuffer response;
  grpc::Status status;
  const auto reader = stub.PrepareUnaryCall(&context, path, request, &queue);
  reader->StartCall();
  reader->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  return status;
}

TEST_F(SecureServerTest, EveryMethodAsksWhoCallsAndWhatTheyMayDo) {
  Start(WithUsers({}));
  const std::vector<std::string> paths = testing::PathsOfAllMethods();
  EXPECT_GT(paths.size(), 12u);
  for (const std::string& path : paths) {
    const Right right = RuleOf(path).value().right;
    if (right == Right::kNone) continue;  // health; it streams for ever
    EXPECT_EQ(CallRaw(server_->address(), path, "").error_code(), grpc::StatusCode::UNAUTHENTICATED) << path;
    EXPECT_EQ(CallRaw(server_->address(), path, "dlcs_wrong").error_code(), grpc::StatusCode::UNAUTHENTICATED) << path;
    const grpc::Status reading = CallRaw(server_->address(), path, kReader);
    if (right > Right::kReader) {
      EXPECT_EQ(reading.error_code(), grpc::StatusCode::PERMISSION_DENIED) << path;
      EXPECT_THAT(reading.error_message(), HasSubstr(RightName(right))) << path;
    } else {
      EXPECT_NE(reading.error_code(), grpc::StatusCode::PERMISSION_DENIED) << path;
      EXPECT_NE(reading.error_code(), grpc::StatusCode::UNAUTHENTICATED) << path;
    }
  }
  EXPECT_TRUE(CallRaw(server_->address(), "/grpc.health.v1.Health/Check", "").ok());
  EXPECT_EQ(CallRaw(server_->address(), "/dlcs.v1.JobService/Other", kAdmin).error_code(),
            grpc::StatusCode::UNIMPLEMENTED);
}

TEST_F(SecureServerTest, NoTokenAndAWrongOneAreToldApartAndNotRepeated) {
  Start(WithUsers({}));
  EXPECT_EQ(Ask(Options()).code(), absl::StatusCode::kUnauthenticated);
  EXPECT_THAT(Refusal(Options()), AllOf(HasSubstr("requires a token"), HasSubstr("--token-file")));
  EXPECT_EQ(Ask(Options("dlcs_mistyped")).code(), absl::StatusCode::kUnauthenticated);
  EXPECT_THAT(Refusal(Options("dlcs_mistyped")), AllOf(HasSubstr("not one of"), Not(HasSubstr("mistyped"))));
  EXPECT_TRUE(Ask(Options(kReader)).ok());
}

TEST_F(SecureServerTest, SolvesOfOthersAreNotStopped) {
  Start(WithUsers({}));
  const auto stub = v1::SolverService::NewStub(testing::Connect(server_->address()));
  const auto ask = [](grpc::ClientContext& context, const std::string& token) {
    testing::SetDeadline(context, seconds(60));
    context.AddMetadata("authorization", "Bearer " + token);
  };
  grpc::ClientContext solving;
  ask(solving, kAlice);
  const auto reader = stub->Solve(&solving, testing::SteppingRequest(20'000'000));
  v1::SolveEvent event;
  ASSERT_TRUE(reader->Read(&event));
  const auto stop = [&](const std::string& token) {
    grpc::ClientContext context;
    ask(context, token);
    v1::StopSolveRequest request;
    request.set_solve_id(event.accepted().solve_id());
    v1::StopSolveResponse response;
    return stub->StopSolve(&context, request, &response).error_code();
  };
  EXPECT_EQ(stop(kBob), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(stop(kAlice), grpc::StatusCode::OK);
  while (reader->Read(&event)) continue;
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_EQ(event.summary().termination(), v1::TERMINATION_CANCELLED);
}

TEST_F(SecureServerTest, JobsOfOthersAreNotFound) {
  Start(WithUsers({}));
  const auto alice = Jobs(kAlice), bob = Jobs(kBob), admin = Jobs(kAdmin), reader = Jobs(kReader);
  const std::string job = Submit(*alice, SwitchingRequest(200), "mine");
  ASSERT_TRUE(Watch(*alice, job).ok());
  v1::ReadTrajectoryRequest read;
  read.set_name(job);
  const auto ignore = [](const v1::TrajectoryPage&) {};
  for (Client* other : {bob.get(), reader.get()}) {
    EXPECT_EQ(other->jobs().Get(job, {}).status().code(), absl::StatusCode::kNotFound);
    EXPECT_EQ(Watch(*other, job).code(), absl::StatusCode::kNotFound);
    EXPECT_EQ(other->jobs().ReadTrajectory(read, ignore, {}).code(), absl::StatusCode::kNotFound);
    EXPECT_TRUE(other->jobs().List({}, 10, {})->empty());
  }
  EXPECT_EQ(bob->jobs().Cancel(job, {}).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(bob->jobs().Delete(job, {}).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(reader->jobs().Delete(job, {}).code(), absl::StatusCode::kPermissionDenied);
  // The same answer, word for word, as for a job that never existed.
  EXPECT_EQ(std::string(bob->jobs().Get(job, {}).status().message()).size(),
            std::string(bob->jobs().Get("jobs/" + std::string(26, 'a'), {}).status().message()).size());

  // A request_id is the user's own too.
  EXPECT_NE(Submit(*bob, SwitchingRequest(200), "mine"), job);
  EXPECT_EQ(Submit(*alice, SwitchingRequest(200), "mine"), job);
  EXPECT_EQ(alice->jobs().List({}, 10, {})->size(), 1u);
  EXPECT_EQ(admin->jobs().List({}, 10, {})->size(), 2u);
  EXPECT_TRUE(admin->jobs().Get(job, {}).ok());
  EXPECT_TRUE(admin->jobs().ReadTrajectory(read, ignore, {}).ok());
  EXPECT_TRUE(alice->jobs().Delete(job, {}).ok());
  EXPECT_EQ(admin->jobs().Get(job, {}).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(SecureServerTest, JobsFromBeforeThereWereUsersBelongToAdmins) {
  Start({});
  const std::string job = Submit(*Jobs(""), SwitchingRequest(50));
  Start(WithUsers({}));
  EXPECT_EQ(Jobs(kAlice)->jobs().Get(job, {}).status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(Jobs(kAdmin)->jobs().Get(job, {}).ok());
}

TEST_F(SecureServerTest, TokensAreReadAgain) {
  Start(WithUsers({}), false);
  ReplaceFile(folder_.File("tokens.txt"), "carl reader " + TokenHashText("dlcs_new") + "\n");
  EXPECT_TRUE(Becomes([&] { return Ask(Options("dlcs_new")).ok(); }));
  EXPECT_EQ(Ask(Options(kAlice)).code(), absl::StatusCode::kUnauthenticated);
}

TEST_F(SecureServerTest, OneUserHasSoManyWatches) {
  AccessSettings access = WithUsers({});
  access.max_watches_per_user = 1;
  Start(access);
  const auto alice = Jobs(kAlice);
  const std::string job = Submit(*alice, testing::SteppingRequest(4'000'000));
  grpc::ClientContext context;
  testing::SetDeadline(context, milliseconds(60'000));
  context.AddMetadata("authorization", "Bearer " + kAlice);
  v1::WatchSolveJobRequest request;
  request.set_name(job);
  const auto stub = v1::JobService::NewStub(testing::Connect(server_->address()));
  const auto first = stub->WatchSolveJob(&context, request);
  v1::SolveEvent event;
  ASSERT_TRUE(first->Read(&event));
  const absl::Status second =
      alice->jobs().Watch(request, [](const v1::SolveEvent&) {}, {.deadline = seconds(2), .stop = {}});
  EXPECT_EQ(second.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(second.message()), HasSubstr("max_watches_per_user = 1"));
  EXPECT_TRUE(alice->jobs().Cancel(job, {}).ok());
  while (first->Read(&event)) {
  }
  EXPECT_TRUE(first->Finish().ok());
  EXPECT_TRUE(Becomes([&] { return Watch(*alice, job).ok(); }));
}

TEST_F(SecureServerTest, EncryptsAndProvesWhoItIs) {
  Start(WithUsers(Tls(authority_.Issue("localhost"))));
  EXPECT_TRUE(Ask(Encrypted(authority_, kReader)).ok()) << Ask(Encrypted(authority_, kReader));
  EXPECT_THAT(Refusal(Encrypted(authority_)), HasSubstr("requires a token"));
  EXPECT_THAT(Refusal(Encrypted(foreign_, kReader)),
              AllOf(HasSubstr(server_->address()), HasSubstr("not from an authority in " + folder_.File("ca.pem"))));
  ConnectionOptions of_this_machine = Options();
  of_this_machine.tls = true;
  EXPECT_THAT(Refusal(of_this_machine), HasSubstr("--tls-ca"));
  EXPECT_THAT(Refusal(Options()), HasSubstr("it wants encrypted connections; name the authority"));
  // A job from its creation to its deletion.
  const auto client = *Client::Connect(Encrypted(authority_, kAlice));
  EXPECT_TRUE(Watch(*client, Submit(*client, SwitchingRequest(100))).ok());
}

TEST_F(SecureServerTest, ClientsSayWhatIsWrongWithTheCertificateOfAServer) {
  Start(Tls(authority_.Issue("localhost", -1)), false);
  EXPECT_THAT(Refusal(Encrypted(authority_)), HasSubstr("its certificate has expired"));
  Start(Tls(authority_.Issue("elsewhere", 30, "DNS:elsewhere.example")), false);
  EXPECT_THAT(Refusal(Encrypted(authority_)), HasSubstr("its certificate is not for 127.0.0.1"));
  Start({}, false);
  EXPECT_THAT(Refusal(Encrypted(authority_)), HasSubstr("it does not encrypt connections"));
  // No client is told to retry if a retry cannot help.
  int notices = 0;
  const auto client = *Client::Connect(Encrypted(authority_), [&](const std::string&) { ++notices; });
  EXPECT_EQ(client->jobs().List({}, 1, {.deadline = seconds(60), .stop = {}}).status().code(),
            absl::StatusCode::kUnavailable);
  EXPECT_EQ(notices, 0);
}

TEST_F(SecureServerTest, WithClientAuthoritiesClientsProveWhoTheyAre) {
  AccessSettings access = Tls(authority_.Issue("localhost"));
  access.tls_client_ca = File("client-ca.pem", authority_.certificate());
  File("tokens.txt", UserLines() + "sensor reader certificate\nsensor.example reader certificate\n");
  access.tokens = folder_.File("tokens.txt");
  Start(access, false);
  const ConnectionOptions without = Encrypted(authority_, kReader);
  EXPECT_THAT(Refusal(without), AllOf(HasSubstr("a client without a certificate"), HasSubstr("--tls-cert")));
  EXPECT_THAT(Refusal(Showing(foreign_.Issue("sensor"), without)),
              AllOf(HasSubstr("client.pem"), HasSubstr("from an authority that it trusts")));
  EXPECT_THAT(Refusal(Showing(authority_.Issue("sensor", -1), without)), HasSubstr("expired"));
  const ConnectionOptions no_token = Encrypted(authority_);
  EXPECT_TRUE(Ask(Showing(authority_.Issue("sensor"), no_token)).ok());
  EXPECT_TRUE(Ask(Showing(authority_.Issue("someone", 30, "DNS:sensor.example"), no_token)).ok());
  EXPECT_THAT(Refusal(Showing(authority_.Issue("someone"), no_token)),
              HasSubstr("has no user with the name of the client certificate"));
  EXPECT_TRUE(Ask(Showing(authority_.Issue("someone"), without)).ok());
}

TEST_F(SecureServerTest, CertificatesAreReadAgainAndBrokenOnesAreNot) {
  Start(Tls(authority_.Issue("localhost")), false);
  const testing::TestAuthority next;
  ASSERT_TRUE(Ask(Encrypted(authority_)).ok());
  // The files while somebody copies them: the new certificate with the old key, half of it, none.
  const Issued issued = next.Issue("localhost");
  for (const std::string& broken : {issued.certificate, issued.certificate.substr(0, 300), std::string()}) {
    File("server.pem", broken);
    server_->Reload();
    EXPECT_TRUE(Ask(Encrypted(authority_)).ok());
  }
  Tls(issued);
  EXPECT_TRUE(Becomes([&] { return Ask(Encrypted(next)).ok(); }));
  EXPECT_THAT(Refusal(Encrypted(authority_)), HasSubstr("not from an authority"));
}

TEST_F(SecureServerTest, ATokenIsNotSentInPlainTextToOtherMachines) {
  for (const char* address :
       {"192.0.2.1:1", "example.com:1", "localhost.example.com:1", "[2001:db8::1]:1", "127.0.0.1.example:1"}) {
    ConnectionOptions options(address);
    options.token = kAlice;
    const absl::Status refused = Client::Connect(options).status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument) << address;
    EXPECT_THAT(std::string(refused.message()), AllOf(HasSubstr("without encryption"), Not(HasSubstr(kAlice))));
    options.tls = true;
    EXPECT_TRUE(Client::Connect(options).ok()) << address;
  }
  for (const char* address : {"localhost:1", "127.0.0.2:1", "[::1]:1"}) {
    ConnectionOptions options(address);
    options.token = kAlice;
    EXPECT_TRUE(Client::Connect(options).ok()) << address;
    options.token = "two words";
    EXPECT_THAT(std::string(Client::Connect(options).status().message()), HasSubstr("one word"));
  }
}

TEST_F(SecureServerTest, FilesOfAClientAreCheckedFirst) {
  const Issued mine = authority_.Issue("me"), other = authority_.Issue("other");
  ConnectionOptions options("localhost:1");
  const auto refusal = [&] { return std::string(Client::Connect(options).status().message()); };
  options.tls_ca = folder_.File("none");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("tls_ca: "), HasSubstr("none: cannot be read: No such file")));
  options.tls_ca = File("ca.pem", mine.key);
  EXPECT_THAT(refusal(), HasSubstr("ca.pem: holds no certificate"));
  options.tls_ca = File("ca.pem", authority_.certificate() + mine.certificate.substr(0, 200));
  EXPECT_THAT(refusal(), HasSubstr("ca.pem: certificate 2 is damaged"));
  options.tls_ca = "";
  options.tls_cert = File("client.pem", mine.certificate);
  EXPECT_THAT(refusal(), HasSubstr("tls_key: must be given where there is a certificate"));
  options.tls_key = File("client.key", other.key);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("tls_key: "), HasSubstr("is not the key of the first certificate in")));
}

// The program: its flags, its log, its signals.

class SecureDlcsdTest : public SecureServerTest {
 protected:
  static std::string WhatEnds(const std::vector<std::string>& flags, int code) {
    DlcsdProcess dlcsd(flags);
    EXPECT_EQ(dlcsd.ReadLine(), "");
    EXPECT_EQ(dlcsd.Wait(), code);
    return dlcsd.ReadErrors();
  }
};

TEST_F(SecureDlcsdTest, ServesOtherMachinesOnlyWhenAskedTo) {
  EXPECT_THAT(WhatEnds({"--listen", "0.0.0.0:0"}, 2),
              AllOf(HasSubstr("--listen 0.0.0.0:0: other machines can reach this address"), HasSubstr("--tls-cert"),
                    HasSubstr("--insecure-listen")));
  DlcsdProcess asked({"--listen", "0.0.0.0:0", "--insecure-listen"});
  EXPECT_NE(asked.ReadAddress(), "");
  Tls(authority_.Issue("localhost"));
  DlcsdProcess encrypted(
      {"--listen", "0.0.0.0:0", "--tls-cert", folder_.File("server.pem"), "--tls-key", folder_.File("server.key")});
  EXPECT_NE(encrypted.ReadAddress(), "");
}

TEST_F(SecureDlcsdTest, ACallerWithoutEncryptionIsNoErrorOfItsOwn) {
  Tls(authority_.Issue("localhost"));
  DlcsdProcess dlcsd(
      {"--listen", "127.0.0.1:0", "--tls-cert", folder_.File("server.pem"), "--tls-key", folder_.File("server.key")});
  ConnectionOptions plain(dlcsd.ReadAddress());
  EXPECT_FALSE((*Client::Connect(plain))->Solve(SwitchingRequest(50), {}, {}).ok());
  dlcsd.Signal(SIGTERM);
  EXPECT_EQ(dlcsd.Wait(), 0);
  const std::string log = dlcsd.ReadErrors();
  EXPECT_THAT(log, HasSubstr("info gRPC: Handshake failed"));
  EXPECT_THAT(log, Not(HasSubstr("error gRPC: Handshake")));
}

TEST_F(SecureDlcsdTest, BadFilesEndItWithFlagPathAndRule) {
  Tls(authority_.Issue("localhost"));
  const std::string certificate = folder_.File("server.pem"), key = folder_.File("server.key");
  EXPECT_THAT(WhatEnds({"--listen", "127.0.0.1:0", "--tls-cert", certificate}, 2),
              HasSubstr("--tls-key: must be given"));
  EXPECT_THAT(WhatEnds({"--listen", "127.0.0.1:0", "--tls-cert", certificate, "--tls-key", certificate}, 2),
              HasSubstr("--tls-key " + certificate + ": holds no private key"));
  EXPECT_THAT(WhatEnds({"--listen", "127.0.0.1:0", "--tls-cert", "/nowhere", "--tls-key", key}, 2),
              HasSubstr("--tls-cert /nowhere: cannot be read: No such file"));
  EXPECT_THAT(WhatEnds({"--listen", "127.0.0.1:0", "--tokens", key}, 2), HasSubstr("--tokens " + key + ":1: "));
}

TEST_F(SecureDlcsdTest, WritesDownWhoChangedWhatAndNoToken) {
  File("tokens.txt", UserLines());
  const std::string file = folder_.File("tokens.txt");
  DlcsdProcess dlcsd(
      {"--listen", "127.0.0.1:0", "--store", folder_.File("jobs.db"), "--tokens", file, "--log-level", "debug"});
  const std::string address = dlcsd.ReadAddress();
  const auto connect = [&](const std::string& token) {
    ConnectionOptions options(address);
    options.token = token;
    return *Client::Connect(options);
  };
  const std::string job = Submit(*connect(kAlice), SwitchingRequest(50));
  ASSERT_TRUE(Watch(*connect(kAlice), job).ok());
  ConnectionOptions bob(address);
  bob.token = kBob;
  ASSERT_TRUE((*Client::Connect(bob))->Solve(SwitchingRequest(50), {}, {}).ok());
  EXPECT_EQ(connect(kBob)->jobs().Delete(job, {}).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(connect(kReader)->jobs().Delete(job, {}).code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(connect("dlcs_guessed")->jobs().Delete(job, {}).code(), absl::StatusCode::kUnauthenticated);
  EXPECT_TRUE(connect(kAlice)->jobs().Delete(job, {}).ok());

  // After a signal the new token works at once.
  ReplaceFile(file, UserLines() + "carl reader " + TokenHashText("dlcs_new") + "\n");
  dlcsd.Signal(SIGHUP);
  EXPECT_TRUE(Becomes([&] { return connect("dlcs_new")->jobs().List({}, 1, {}).ok(); }));
  dlcsd.Signal(SIGTERM);
  EXPECT_EQ(dlcsd.Wait(), 0);
  const std::string log = dlcsd.ReadErrors();
  for (const std::string& line :
       {"user=alice method=CreateSolveJob object=" + job + " outcome=OK peer=ipv4:127.0.0.1:",
        "user=bob method=DeleteSolveJob object=" + job + " outcome=NOT_FOUND",
        std::string("user=rita method=DeleteSolveJob object=- outcome=PERMISSION_DENIED"),
        std::string("user=- method=DeleteSolveJob object=- outcome=UNAUTHENTICATED"),
        "user=alice method=DeleteSolveJob object=" + job + " outcome=OK", file + ": read again"}) {
    EXPECT_THAT(log, HasSubstr(line));
  }
  for (const char* line : {"call finished method=dlcs.v1.JobService/CreateSolveJob code=OK seconds=[^ ]+ user=alice ",
                           "call finished method=dlcs.v1.SolverService/Solve code=OK seconds=[^ ]+ user=bob ",
                           "solve finished solve=[^ ]+ user=bob ", "job finished job=jobs/[^ ]+ user=alice "}) {
    EXPECT_THAT(log, ContainsRegex(line));
  }
  for (const std::string& token : {kAlice, kBob, kReader, std::string("dlcs_guessed"), std::string("dlcs_new")}) {
    EXPECT_THAT(log, Not(HasSubstr(token)));
  }
}

TEST_F(SecureDlcsdTest, MakesTokens) {
  const std::string saved = folder_.File("alice.token");
  DlcsdProcess dlcsd({"token", "alice", "--right", "reader", "--save", saved});
  const std::string line = dlcsd.ReadLine();
  EXPECT_EQ(dlcsd.Wait(), 0);
  EXPECT_THAT(line, ::testing::StartsWith("alice reader sha256:"));
  EXPECT_EQ(dlcsd.ReadErrors(), "");
  EXPECT_EQ(std::filesystem::status(saved).permissions(), std::filesystem::perms(0600));
  std::ifstream file(saved);
  std::string token;
  std::getline(file, token);
  EXPECT_EQ(line, "alice reader " + TokenHashText(token));
  File("tokens.txt", line);
  AccessSettings access;
  access.tokens = folder_.File("tokens.txt");
  Start(access, false);
  EXPECT_TRUE(Ask(Options(token)).ok());

  EXPECT_THAT(WhatEnds({"token", "alice", "--save", saved}, 2), HasSubstr("File exists; it may hold another token"));
  EXPECT_THAT(WhatEnds({"token", "two words"}, 2), HasSubstr("NAME \"two words\": must be 1 to 128 letters"));
  EXPECT_THAT(WhatEnds({"token", "alice", "--right", "owner"}, 2),
              HasSubstr("--right: \"owner\" is none of reader, submitter, admin"));
  DlcsdProcess shown({"token", "bob"});
  const std::string bob = shown.ReadLine();
  EXPECT_EQ(shown.Wait(), 0);
  EXPECT_THAT(shown.ReadErrors(), HasSubstr("The token of bob, shown only once: dlcs_"));
  EXPECT_THAT(bob, ::testing::StartsWith("bob submitter sha256:"));
}

}  // namespace
}  // namespace dlcs

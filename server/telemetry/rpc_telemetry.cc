// SPDX-License-Identifier: Apache-2.0
#include "server/telemetry/rpc_telemetry.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "dlcs/v1/jobs.pb.h"
#include "dlcs/v1/solver.pb.h"
#include "fmt/format.h"
#include "google/protobuf/descriptor.h"
#include "google/protobuf/util/time_util.h"
#include "grpcpp/server_context.h"
#include "proto/wire/trace_context.h"
#include "server/access/credentials.h"
#include "server/log.h"
#include "server/wire/status.h"
#include "spdlog/spdlog.h"

namespace dlcs {
namespace {

using grpc::experimental::InterceptionHookPoints;
using grpc::experimental::Interceptor;
using grpc::experimental::InterceptorBatchMethods;
using grpc::experimental::ServerRpcInfo;
using std::chrono::steady_clock;

constexpr const char* kSolve = "dlcs.v1.SolverService/Solve";
constexpr const char* kWatch = "dlcs.v1.JobService/WatchSolveJob";
constexpr const char* kCreate = "dlcs.v1.JobService/CreateSolveJob";

// "/dlcs.v1.SolverService/Solve" without the slash.
std::string NameOf(const char* method) { return method[0] == '/' ? method + 1 : method; }

// The same for a label. Unknown methods share one label, since callers may send any name and each would be kept
// forever.
std::string LabelOf(std::string name) {
  std::string full_name = name;
  std::replace(full_name.begin(), full_name.end(), '/', '.');
  const auto* const pool = google::protobuf::DescriptorPool::generated_pool();
  return pool->FindMethodByName(full_name) != nullptr ? name : "unknown";
}

std::chrono::nanoseconds SinceEpoch(const google::protobuf::Timestamp& time) {
  return std::chrono::nanoseconds(google::protobuf::util::TimeUtil::TimestampToNanoseconds(time));
}

const char* ReasonOf(v1::Gap::Reason reason) {
  switch (reason) {
    case v1::Gap::REASON_INTERVAL:
      return "interval";
    case v1::Gap::REASON_SLOW:
      return "slow";
    case v1::Gap::REASON_NOT_RETAINED:
      return "not_retained";
    default:
      return "unspecified";
  }
}

// One call, from reading its headers until gRPC has finished it.
class Call final : public Interceptor {
 public:
  Call(Metrics& metrics, const Access& access, ServerRpcInfo& info)
      : metrics_(metrics), access_(access), name_(NameOf(info.method())), method_(LabelOf(name_)), info_(info) {
    metrics_.CallBegan(method_);
  }

  ~Call() override {
    const std::chrono::duration<double> took = steady_clock::now() - begin_;
    metrics_.CallEnded(method_, code_, took);
    Log(spdlog::level::debug, "call finished",
        {{"method", name_},
         {"code", code_},
         {"seconds", took.count()},
         {"user", user_},
         {"solve", solve_},
         {"job", job_},
         {"trace_id", trace_id_},
         {"peer", peer_}});
  }

  void Intercept(InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) ReadMetadata(*methods);
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_MESSAGE)) Look(methods->GetSendMessage());
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) {
      code_ = absl::StatusCodeToString(static_cast<absl::StatusCode>(methods->GetSendStatus().error_code()));
    }
    methods->Proceed();
  }

 private:
  void ReadMetadata(InterceptorBatchMethods& methods) {
    const auto* const metadata = methods.GetRecvInitialMetadata();
    const auto found = metadata->find(kTraceparent);
    if (found != metadata->end()) trace_id_ = TraceIdOf({found->second.data(), found->second.size()});
    // Looking up the user costs more than the rest.
    if (!spdlog::should_log(spdlog::level::debug)) return;
    peer_ = PeerOf(access_, *info_.server_context());
    user_ = UserOf(access_, *info_.server_context());
  }

  // `message` is of the type that the method sends.
  void Look(const void* message) {
    if (message == nullptr) return;
    if (method_ == kWatch || method_ == kSolve) LookAt(*static_cast<const v1::SolveEvent*>(message));
    if (method_ == kCreate) job_ = static_cast<const v1::SolveJob*>(message)->name();
  }

  void LookAt(const v1::SolveEvent& event) {
    if (event.has_accepted()) solve_ = event.accepted().solve_id();
    if (event.has_heartbeat()) return;
    if (event.has_gap()) {
      const v1::Gap& gap = event.gap();
      return metrics_.GapSent(method_, ReasonOf(gap.reason()), gap.last_sequence() - gap.first_sequence() + 1);
    }
    const std::chrono::nanoseconds now = std::chrono::system_clock::now().time_since_epoch();
    const std::chrono::nanoseconds since = SinceEpoch(event.time());
    // Events from before the call, which a watcher requests, have no lag.
    if (since < began_) return metrics_.EventSent(method_);
    metrics_.EventSent(method_, now - since);
  }

  Metrics& metrics_;
  const Access& access_;
  const std::string name_;
  const std::string method_;  // its label
  ServerRpcInfo& info_;
  const steady_clock::time_point begin_ = steady_clock::now();
  const std::chrono::nanoseconds began_ = std::chrono::system_clock::now().time_since_epoch();
  std::string code_ = "CANCELLED";  // unless a status was sent
  std::string user_, solve_, job_, trace_id_, peer_;
};

class Factory final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  Factory(Metrics& metrics, const Access& access) : metrics_(metrics), access_(access) {}
  Interceptor* CreateServerInterceptor(ServerRpcInfo* info) override { return new Call(metrics_, access_, *info); }

 private:
  Metrics& metrics_;
  const Access& access_;
};

}  // namespace

std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> NewRpcTelemetry(Metrics& metrics,
                                                                                       const Access& access) {
  return std::make_unique<Factory>(metrics, access);
}

}  // namespace dlcs

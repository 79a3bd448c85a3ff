// SPDX-License-Identifier: Apache-2.0
#include "server/rpc/unimplemented_service.h"

namespace dlcs {
namespace {

class Refusal final : public grpc::ServerGenericBidiReactor {
 public:
  Refusal() {
    Finish({grpc::StatusCode::UNIMPLEMENTED,
            "This server runs jobs and serves no calls (--role worker): call a server with --role all or front."});
  }
  void OnDone() override { delete this; }
};

}  // namespace

grpc::ServerGenericBidiReactor* UnimplementedService::CreateReactor(grpc::GenericCallbackServerContext*) {
  return new Refusal;
}

}  // namespace dlcs

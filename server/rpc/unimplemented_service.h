// SPDX-License-Identifier: Apache-2.0
// The service of a server that runs jobs only and serves no calls.

#ifndef DLCS_SERVER_RPC_UNIMPLEMENTED_SERVICE_H_
#define DLCS_SERVER_RPC_UNIMPLEMENTED_SERVICE_H_

#include "grpcpp/generic/async_generic_service.h"

namespace dlcs {

// Answers every call that no other service handles with UNIMPLEMENTED and a message that says which server to call
// instead.
class UnimplementedService final : public grpc::CallbackGenericService {
 public:
  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext* context) override;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_UNIMPLEMENTED_SERVICE_H_

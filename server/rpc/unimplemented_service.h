// SPDX-License-Identifier: Apache-2.0
// What a server says that takes no calls.

#ifndef DLCS_SERVER_RPC_UNIMPLEMENTED_SERVICE_H_
#define DLCS_SERVER_RPC_UNIMPLEMENTED_SERVICE_H_

#include "grpcpp/generic/async_generic_service.h"

namespace dlcs {

// Answers every call that no other service answers with UNIMPLEMENTED, and where to go instead.
class UnimplementedService final : public grpc::CallbackGenericService {
 public:
  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext* context) override;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_UNIMPLEMENTED_SERVICE_H_

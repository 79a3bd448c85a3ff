// SPDX-License-Identifier: Apache-2.0
#include "server/access/credentials.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fmt/format.h"
#include "grpc/grpc.h"
#include "grpc/grpc_security.h"
#include "server/wire/status.h"

namespace dlcs {
namespace {

constexpr const char* kAuthorization = "authorization";
// The properties of a certificate that may name a user.
constexpr const char* kPeerNames[] = {GRPC_X509_CN_PROPERTY_NAME, GRPC_X509_SAN_PROPERTY_NAME};

std::string_view View(const grpc_slice& slice) {
  return {reinterpret_cast<const char*>(GRPC_SLICE_START_PTR(slice)), GRPC_SLICE_LENGTH(slice)};
}

// The names in the verified certificate of the client.
std::vector<std::string> CertificateNames(const grpc_auth_context* context) {
  std::vector<std::string> names;
  if (context == nullptr || grpc_auth_context_peer_is_authenticated(context) == 0) return names;
  for (const char* kind : kPeerNames) {
    grpc_auth_property_iterator found = grpc_auth_context_find_properties_by_name(context, kind);
    while (const grpc_auth_property* property = grpc_auth_property_iterator_next(&found)) {
      names.emplace_back(property->value, property->value_length);
    }
  }
  return names;
}

std::vector<std::string> CertificateNames(const grpc::ServerContextBase& context) {
  std::vector<std::string> names;
  const std::shared_ptr<const grpc::AuthContext> shown = context.auth_context();
  if (shown == nullptr || !shown->IsPeerAuthenticated()) return names;
  for (const char* kind : kPeerNames) {
    for (const grpc::string_ref& name : shown->FindPropertyValues(kind)) names.emplace_back(name.data(), name.size());
  }
  return names;
}

std::optional<std::string_view> MetadataOf(const grpc::ServerContextBase& context, const char* key) {
  const auto found = context.client_metadata().find(key);
  if (found == context.client_metadata().end()) return std::nullopt;
  return std::string_view(found->second.data(), found->second.size());
}

std::optional<ForwardedCaller> ForwardedCallerOf(const Access& access, const grpc::ServerContextBase& context) {
  const std::optional<std::string_view> value = MetadataOf(context, kForwardedCaller);
  return value ? access.forwarding_key().Decode(*value) : std::nullopt;
}

// gRPC calls this with the headers of every call, before it reads a message or looks up the method.
void CheckAccess(void* state, grpc_auth_context* context, const grpc_metadata* headers, std::size_t count,
                 grpc_process_auth_metadata_done_cb done, void* call) {
  std::string_view path;
  std::optional<std::string_view> authorization;
  for (const grpc_metadata* header = headers; header != headers + count; ++header) {
    if (View(header->key) == ":path") path = View(header->value);
    // The first one, as in CallerOf().
    if (View(header->key) == kAuthorization && !authorization) authorization = View(header->value);
    if (View(header->key) == kForwardedCaller) {
      static const std::string why =
          fmt::format("The metadata {} is reserved for the server itself.", kForwardedCaller);
      return done(call, nullptr, 0, nullptr, 0, GRPC_STATUS_PERMISSION_DENIED, why.c_str());
    }
  }
  const std::vector<std::string> names = CertificateNames(context);
  const grpc::Status verdict = ToGrpc(static_cast<const Access*>(state)->MayCall(path, authorization, names));
  done(call, nullptr, 0, nullptr, 0, static_cast<grpc_status_code>(verdict.error_code()),
       verdict.ok() ? nullptr : verdict.error_message().c_str());
}

// The C++ API of gRPC 1.51 cannot replace certificates in memory (its FileWatcherCertificateProvider loads broken files
// too, and then refuses every connection), and has no authentication on sockets without TLS. Its C API has both.
class Credentials final : public grpc::ServerCredentials {
 public:
  explicit Credentials(const Access& access) : access_(access) {}

  void SetAuthMetadataProcessor(const std::shared_ptr<grpc::AuthMetadataProcessor>&) override {}

 private:
  int AddPortToServer(const std::string& address, grpc_server* server) override {
    grpc_server_credentials* const credentials = access_.Tls() ? MakeTls() : grpc_insecure_server_credentials_create();
    if (credentials == nullptr) return 0;
    grpc_server_credentials_set_auth_metadata_processor(credentials,
                                                        {CheckAccess, nullptr, const_cast<Access*>(&access_)});
    const int port = grpc_server_add_http2_port(server, address.c_str(), credentials);
    grpc_server_credentials_release(credentials);
    return port;
  }

  grpc_server_credentials* MakeTls() {
    const auto request = access_.Tls()->client_ca.empty() ? GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE
                                                          : GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY;
    return grpc_ssl_server_credentials_create_with_options(
        grpc_ssl_server_credentials_create_options_using_config_fetcher(request, FetchCertificate, this));
  }

  // gRPC calls this before every handshake, one at a time.
  static grpc_ssl_certificate_config_reload_status FetchCertificate(void* self,
                                                                    grpc_ssl_server_certificate_config** config) {
    Credentials& credentials = *static_cast<Credentials*>(self);
    const std::shared_ptr<const TlsFiles> files = credentials.access_.Tls();
    if (files == credentials.served_) return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
    const grpc_ssl_pem_key_cert_pair pair{files->key.c_str(), files->certificate.c_str()};
    // gRPC requires authorities even if clients need no certificate, and does not use them then.
    const std::string& authorities = files->client_ca.empty() ? files->certificate : files->client_ca;
    *config = grpc_ssl_server_certificate_config_create(authorities.c_str(), &pair, 1);
    credentials.served_ = files;
    return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
  }

  const Access& access_;
  std::shared_ptr<const TlsFiles> served_;
};

}  // namespace

std::shared_ptr<grpc::ServerCredentials> CredentialsFor(const Access& access) {
  return std::make_shared<Credentials>(access);
}

bool IsForwarded(const grpc::ServerContextBase& context) {
  return MetadataOf(context, kForwardedCaller).has_value();  // calls from outside with it are refused
}

std::string PeerOf(const Access& access, const grpc::ServerContextBase& context) {
  const std::optional<ForwardedCaller> forwarded = ForwardedCallerOf(access, context);
  return forwarded ? forwarded->peer : context.peer();
}

absl::StatusOr<Caller> CallerOf(const Access& access, const grpc::ServerContextBase& context) {
  const std::optional<ForwardedCaller> forwarded = ForwardedCallerOf(access, context);
  const auto with_peer = [&](Caller caller) {
    caller.peer = forwarded ? forwarded->peer : context.peer();
    return caller;
  };
  if (!access.HasUsers()) return with_peer({});
  const std::optional<std::string_view> authorization = MetadataOf(context, kAuthorization);
  const std::vector<std::string> names = forwarded ? forwarded->certificate_names : CertificateNames(context);
  absl::StatusOr<Caller> caller = access.Identify(authorization, names);
  return caller.ok() ? with_peer(*std::move(caller)) : caller;
}

std::string UserOf(const Access& access, const grpc::ServerContextBase& context) {
  const absl::StatusOr<Caller> caller = CallerOf(access, context);
  return caller.ok() ? caller->user : "";
}

}  // namespace dlcs

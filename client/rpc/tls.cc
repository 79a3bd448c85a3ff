// SPDX-License-Identifier: Apache-2.0
#include "client/rpc/tls.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <ctime>
#include <memory>
#include <tuple>
#include <utility>

#include "proto/shared/pem.h"
#include "proto/shared/small_file.h"

namespace dlcs::client {
namespace {

using Context = std::unique_ptr<SSL_CTX, FreeWith<SSL_CTX_free>>;
using Session = std::unique_ptr<SSL, FreeWith<SSL_free>>;

absl::Status Broken(const char* field, const std::string& file, const std::string& rule) {
  ERR_clear_error();
  return absl::InvalidArgumentError(fmt::format("{}: {}: {}", field, file, rule));
}

absl::Status Broken(const char* field, const std::string& file, const absl::Status& why) {
  return Broken(field, file, std::string(why.message()));
}

absl::StatusOr<TlsTexts> ReadFiles(const ConnectionOptions& options) {
  TlsTexts texts;
  for (const auto& [field, file, text] :
       {std::tuple{"tls_ca", &options.tls_ca, &texts.ca}, std::tuple{"tls_cert", &options.tls_cert, &texts.certificate},
        std::tuple{"tls_key", &options.tls_key, &texts.key}}) {
    if (file->empty()) continue;
    absl::StatusOr<std::string> read = ReadSmallFile(*file);
    if (!read.ok()) {
      return absl::InvalidArgumentError(fmt::format("{}: {}", field, std::string(read.status().message())));
    }
    *text = *std::move(read);
  }
  return texts;
}

absl::Status TrustAuthorities(const std::string& file, const std::string& pem, SSL_CTX* context) {
  const auto authorities = ParseCertificates(pem);
  if (!authorities.ok()) return Broken("tls_ca", file, authorities.status());
  for (const X509Certificate& authority : *authorities) {
    X509_STORE_add_cert(SSL_CTX_get_cert_store(context), authority.get());
  }
  return absl::OkStatus();
}

absl::Status ShowCertificate(const ConnectionOptions& options, const TlsTexts& texts, SSL_CTX* context) {
  const auto certificates = ParseCertificates(texts.certificate);
  if (!certificates.ok()) return Broken("tls_cert", options.tls_cert, certificates.status());
  const auto key = ParsePrivateKey(texts.key);
  if (!key.ok()) return Broken("tls_key", options.tls_key, key.status());
  if (X509_check_private_key(certificates->front().get(), key->get()) != 1) {
    return Broken("tls_key", options.tls_key,
                  fmt::format("is not the key of the first certificate in {}", options.tls_cert));
  }
  bool taken = SSL_CTX_use_certificate(context, certificates->front().get()) == 1;
  for (std::size_t k = 1; k < certificates->size(); ++k) {
    taken = taken && SSL_CTX_add1_chain_cert(context, (*certificates)[k].get()) == 1;
  }
  if (taken && SSL_CTX_use_PrivateKey(context, key->get()) == 1) return absl::OkStatus();
  return Broken("tls_cert", options.tls_cert,
                fmt::format("cannot be used: {}", ERR_reason_error_string(ERR_peek_last_error())));
}

// The TLS context for the files. Errors: InvalidArgument, as ReadTls().
absl::StatusOr<Context> MakeContext(const ConnectionOptions& options, const TlsTexts& texts) {
  Context context(SSL_CTX_new(TLS_client_method()));
  if (context == nullptr) return absl::InternalError("OpenSSL gives no context");
  if (options.tls_ca.empty()) {
    SSL_CTX_set_default_verify_paths(context.get());
  } else if (absl::Status status = TrustAuthorities(options.tls_ca, texts.ca, context.get()); !status.ok()) {
    return status;
  }
  if (options.tls_cert.empty()) return context;
  if (absl::Status status = ShowCertificate(options, texts, context.get()); !status.ok()) return status;
  return context;
}

struct Place {
  std::string host;  // without brackets
  std::string port;
};

Place PlaceOf(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  std::string host = address.substr(0, colon);
  if (host.size() > 2 && host.front() == '[') host = host.substr(1, host.size() - 2);
  return {host, address.substr(colon + 1)};
}

class Socket {
 public:
  // Connected, or not: see ok().
  explicit Socket(const Place& place) {
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    if (getaddrinfo(place.host.c_str(), place.port.c_str(), &hints, &found) != 0) return;
    for (const addrinfo* address = found; address != nullptr && !ok_; address = address->ai_next) Connect(*address);
    freeaddrinfo(found);
  }
  ~Socket() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  bool ok() const { return ok_; }
  int descriptor() const { return descriptor_; }

 private:
  void Connect(const addrinfo& address) {
    if (descriptor_ >= 0) close(descriptor_);
    descriptor_ = socket(address.ai_family, address.ai_socktype | SOCK_CLOEXEC, address.ai_protocol);
    if (descriptor_ < 0) return;
    const timeval patience{.tv_sec = 2, .tv_usec = 0};  // of connecting and of every read
    setsockopt(descriptor_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof(patience));
    setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    ok_ = connect(descriptor_, address.ai_addr, address.ai_addrlen) == 0;
  }

  int descriptor_ = -1;
  bool ok_ = false;
};

// OpenSSL writes without MSG_NOSIGNAL: a closed connection must not end this program.
class NoSigpipe {
 public:
  NoSigpipe() {
    sigemptyset(&sigpipe_);
    sigaddset(&sigpipe_, SIGPIPE);
    sigset_t before;
    pthread_sigmask(SIG_BLOCK, &sigpipe_, &before);
    was_blocked_ = sigismember(&before, SIGPIPE) == 1;
  }
  ~NoSigpipe() {
    if (was_blocked_) return;
    const timespec no_wait{};
    sigtimedwait(&sigpipe_, nullptr, &no_wait);
    pthread_sigmask(SIG_UNBLOCK, &sigpipe_, nullptr);
  }
  NoSigpipe(const NoSigpipe&) = delete;
  NoSigpipe& operator=(const NoSigpipe&) = delete;

 private:
  sigset_t sigpipe_;
  bool was_blocked_ = false;
};

void ExpectHost(const std::string& host, SSL* session) {
  X509_VERIFY_PARAM* const expected = SSL_get0_param(session);
  if (X509_VERIFY_PARAM_set1_ip_asc(expected, host.c_str()) == 1) return;
  X509_VERIFY_PARAM_set1_host(expected, host.c_str(), 0);
  SSL_set_tlsext_host_name(session, host.c_str());
}

std::string BadServerCertificate(long verdict, const ConnectionOptions& options, const std::string& host) {
  switch (verdict) {
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return "its certificate has expired; the operator has to renew it";
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return "its certificate is not valid yet; is the clock of this machine right?";
    case X509_V_ERR_HOSTNAME_MISMATCH:
    case X509_V_ERR_IP_ADDRESS_MISMATCH:
      return fmt::format("its certificate is not for {}; use a name that is in the certificate", host);
    default:
      return fmt::format(
          "its certificate is not from an authority in {} ({})",
          options.tls_ca.empty() ? "the store of this machine; name its authority with --tls-ca" : options.tls_ca,
          X509_verify_cert_error_string(verdict));
  }
}

// Whether the last call failed with a TLS alert, which only a TLS server can send.
bool RefusesInTls() {
  const unsigned long error = ERR_peek_last_error();
  return ERR_GET_LIB(error) == ERR_LIB_SSL && ERR_GET_REASON(error) > SSL_AD_REASON_OFFSET;
}

// Why a server closes the connection although the client accepted its certificate. gRPC servers send no reason.
std::string RefusalOfClient(const ConnectionOptions& options, const SSL_CTX& context) {
  if (options.tls_cert.empty()) {
    return "it closed the connection of a client without a certificate; give one with --tls-cert and --tls-key";
  }
  const X509* const certificate = SSL_CTX_get0_certificate(&context);
  if (certificate != nullptr && X509_cmp_current_time(X509_get0_notAfter(certificate)) < 0) {
    return fmt::format("it closed the connection because the client certificate in {} has expired", options.tls_cert);
  }
  return fmt::format("it closed the connection; the client certificate in {} must be from an authority that it trusts",
                     options.tls_cert);
}

}  // namespace

absl::StatusOr<TlsTexts> ReadTls(const ConnectionOptions& options) {
  if (options.tls_cert.empty() != options.tls_key.empty()) {
    return absl::InvalidArgumentError(options.tls_cert.empty() ? "tls_cert: must be given where there is a key"
                                                               : "tls_key: must be given where there is a certificate");
  }
  absl::StatusOr<TlsTexts> texts = ReadFiles(options);
  if (!texts.ok()) return texts;
  const absl::StatusOr<Context> usable = MakeContext(options, *texts);
  if (!usable.ok()) return usable.status();
  return texts;
}

std::optional<std::string> DiagnoseTls(const ConnectionOptions& options) {
  const absl::StatusOr<TlsTexts> texts = ReadFiles(options);
  if (!texts.ok()) return std::nullopt;
  const absl::StatusOr<Context> context = MakeContext(options, *texts);
  const Place place = PlaceOf(options.address);
  const Socket socket(place);
  if (!context.ok() || !socket.ok()) return std::nullopt;
  const NoSigpipe no_sigpipe;
  const Session session(SSL_new(context->get()));
  SSL_set_fd(session.get(), socket.descriptor());
  constexpr unsigned char kHttp2[] = {2, 'h', '2'};
  SSL_set_alpn_protos(session.get(), kHttp2, sizeof(kHttp2));
  if (options.UsesTls()) {
    SSL_set_verify(session.get(), SSL_VERIFY_PEER, nullptr);
    ExpectHost(place.host, session.get());
  }
  ERR_clear_error();
  const bool connected = SSL_connect(session.get()) == 1;
  if (!options.UsesTls()) {
    // A TLS server accepts the handshake, or refuses it with a TLS alert.
    if (!connected && !RefusesInTls()) return std::nullopt;
    return "it wants encrypted connections; name the authority of its certificate with --tls-ca, or give --tls where "
           "this machine knows that authority";
  }
  if (!connected) {
    const long verdict = SSL_get_verify_result(session.get());
    if (verdict != X509_V_OK) return BadServerCertificate(verdict, options, place.host);
    const int reason = ERR_GET_REASON(ERR_peek_last_error());
    if (reason == SSL_R_WRONG_VERSION_NUMBER || reason == SSL_R_HTTP_REQUEST) {
      return "it does not encrypt connections; call it without the --tls options, if the network may be trusted";
    }
    return RefusesInTls() ? std::optional(RefusalOfClient(options, **context)) : std::nullopt;
  }
  // With TLS 1.3 the client's handshake ends before the server has checked its certificate. An HTTP/2 server sends
  // first.
  char byte = 0;
  const int got = SSL_read(session.get(), &byte, 1);
  const bool still_waiting = got <= 0 && SSL_get_error(session.get(), got) == SSL_ERROR_WANT_READ;
  if (got == 1 || still_waiting) return std::nullopt;
  return RefusalOfClient(options, **context);
}

}  // namespace dlcs::client

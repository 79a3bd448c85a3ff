// SPDX-License-Identifier: Apache-2.0
#include "server/gateway/web_port.h"

#include <zlib.h>

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

#include "fmt/format.h"
#include "proto/shared/nearest_name.h"
#include "server/gateway/own_hosts.h"
#include "server/gateway/page_files.h"
#include "server/gateway/rpc_gateway.h"
#include "server/http/http_message.h"
#include "server/http/http_server.h"
#include "server/net/listen_address.h"

namespace dlcs {
namespace {

namespace asio = boost::asio;

constexpr const char* kExposedHeaders = "grpc-status, grpc-message, grpc-status-details-bin";
constexpr const char* kNoPage =
    "This dlcsd was built without its web page. To build it, install npm (deploy/install-packages.sh build does) and\n"
    "build dlcsd again. Calls are served: see proto/README.md.\n";

// Nothing from other servers, no script or style in the HTML itself, no frames around the page.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "font-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string Gzipped(std::string_view bytes) {
  z_stream stream{};
  constexpr int kGzip = 15 + 16;
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzip, 8, Z_DEFAULT_STRATEGY) != Z_OK) return "";
  std::string result(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(result.data());
  stream.avail_out = static_cast<uInt>(result.size());
  const bool whole = deflate(&stream, Z_FINISH) == Z_STREAM_END;
  result.resize(whole ? stream.total_out : 0);
  deflateEnd(&stream);
  return result;
}

// Adds `headers` to every response of another exchange.
class WithHeaders final : public HttpExchange {
 public:
  WithHeaders(HttpExchange& inner, HttpHeaders headers) : inner_(inner), headers_(std::move(headers)) {}

  const HttpRequest& request() const override { return inner_.request(); }
  asio::any_io_executor executor() const override { return inner_.executor(); }
  asio::awaitable<absl::StatusOr<std::string>> ReadBody(std::size_t max_bytes) override {
    return inner_.ReadBody(max_bytes);
  }
  void OnDisconnect(std::function<void()> disconnected) override { inner_.OnDisconnect(std::move(disconnected)); }
  asio::awaitable<void> Reply(HttpResponse response) override {
    response.headers.insert(response.headers.end(), headers_.begin(), headers_.end());
    return inner_.Reply(std::move(response));
  }
  asio::awaitable<void> Begin(int status, HttpHeaders headers) override {
    headers.insert(headers.end(), headers_.begin(), headers_.end());
    return inner_.Begin(status, std::move(headers));
  }
  asio::awaitable<bool> Write(std::string piece) override { return inner_.Write(std::move(piece)); }
  asio::awaitable<void> End() override { return inner_.End(); }

 private:
  HttpExchange& inner_;
  const HttpHeaders headers_;
};

}  // namespace

class WebPort::State {
 public:
  State(const WebPortOptions& options, const std::string& listen_host, const Access& access,
        std::shared_ptr<grpc::Channel> channel)
      : origins_(options.origins),
        hosts_(options.hosts),
        gateway_(std::move(channel), access, options.max_message_bytes) {
    hosts_.Add(listen_host);
    for (const PageFile& file : PageFiles()) {
      Asset asset{std::string(file.content_type), file.bytes, Gzipped(file.bytes)};
      assets_.emplace(std::string(file.path), std::move(asset));
    }
  }

  asio::awaitable<void> Handle(HttpExchange& exchange) {
    const HttpRequest& request = exchange.request();
    if (!hosts_.Has(request.Header("host"))) {
      HttpResponse refusal =
          TextResponse(421, fmt::format("This server does not go by the name \"{}\". If it should, start it "
                                        "with --http-hosts.\n",
                                        HostIn(request.Header("host")).substr(0, 100)));
      refusal.headers.emplace_back("x-content-type-options", "nosniff");
      co_await exchange.Reply(std::move(refusal));
      co_return;
    }
    const std::string origin(request.Header("origin"));
    const bool is_allowed_origin = std::find(origins_.begin(), origins_.end(), origin) != origins_.end();
    HttpHeaders headers = {{"x-content-type-options", "nosniff"}};
    if (!origins_.empty()) headers.emplace_back("vary", "origin");
    if (is_allowed_origin) {
      headers.emplace_back("access-control-allow-origin", origin);
      headers.emplace_back("access-control-expose-headers", kExposedHeaders);
    }
    WithHeaders response(exchange, std::move(headers));
    const bool is_method = RpcGateway::FindMethod(request.path) != nullptr;
    if (request.method == "POST" && is_method) {
      co_await gateway_.Answer(response);
      co_return;
    }
    HttpResponse reply = ResponseTo(request, is_method, is_allowed_origin);
    co_await response.Reply(std::move(reply));
  }

  std::unique_ptr<HttpServer> server;
  std::string address;

 private:
  struct Asset {
    std::string content_type;
    std::string_view bytes;
    std::string gzipped;
  };

  HttpResponse ResponseTo(const HttpRequest& request, bool is_method, bool is_allowed_origin) const {
    constexpr std::size_t kLongestPath = 100;  // that is compared with those of methods
    if (request.method == "OPTIONS" && is_method) {
      HttpResponse preflight{.status = 204, .headers = {{"allow", "POST"}}, .body = ""};
      if (!is_allowed_origin) return preflight;
      preflight.headers.emplace_back("access-control-allow-methods", "POST");
      preflight.headers.emplace_back("access-control-allow-headers",
                                     "authorization, content-type, connect-protocol-version, connect-timeout-ms, "
                                     "grpc-timeout, traceparent, x-grpc-web, x-user-agent");
      preflight.headers.emplace_back("access-control-max-age", "7200");
      return preflight;
    }
    if (is_method) return Refused("POST");
    const auto found = assets_.find(request.path);
    if (found == assets_.end() && request.path != "/") {
      const bool is_call = request.path.starts_with("/dlcs") && request.path.size() <= kLongestPath;
      const auto meant = is_call ? NearestName(request.path, RpcGateway::MethodPaths()) : std::nullopt;
      return TextResponse(404, fmt::format("There is the page at /, and calls at /dlcs.v1.SERVICE/METHOD{}\n",
                                           meant ? DidYouMean(meant) : "."));
    }
    if (request.method != "GET" && request.method != "HEAD") return Refused("GET, HEAD");
    return found == assets_.end() ? TextResponse(200, kNoPage) : Serve(request, found->second);
  }

  static HttpResponse Refused(const char* allowed) {
    HttpResponse refusal = TextResponse(405, fmt::format("only {} is served here\n", allowed));
    refusal.headers.emplace_back("allow", allowed);
    return refusal;
  }

  static HttpResponse Serve(const HttpRequest& request, const Asset& asset) {
    const bool gzip =
        request.Header("accept-encoding").find("gzip") != std::string_view::npos && !asset.gzipped.empty();
    HttpResponse response;
    response.headers = {{"content-type", asset.content_type},
                        {"content-security-policy", kPolicy},
                        {"referrer-policy", "no-referrer"},
                        {"cross-origin-opener-policy", "same-origin"},
                        {"cross-origin-resource-policy", "same-origin"},
                        // The name of every file except the page itself contains a hash of its content.
                        {"cache-control", request.path == "/" ? "no-cache" : "public, max-age=31536000, immutable"}};
    if (gzip) response.headers.emplace_back("content-encoding", "gzip");
    response.body = gzip ? asset.gzipped : std::string(asset.bytes);
    return response;
  }

  const std::vector<std::string> origins_;
  OwnHosts hosts_;
  RpcGateway gateway_;
  std::map<std::string, Asset> assets_;
};

WebPort::WebPort(std::unique_ptr<State> state) : state_(std::move(state)) {}

WebPort::~WebPort() { Close(std::chrono::milliseconds(0)); }

const std::string& WebPort::address() const { return state_->address; }

int WebPort::connections() const { return state_->server->connections(); }

void WebPort::Close(std::chrono::milliseconds delivery) {
  if (state_->server != nullptr) state_->server->Close(delivery);
}

absl::StatusOr<std::unique_ptr<WebPort>> WebPort::Start(const WebPortOptions& options, const Access& access,
                                                        std::shared_ptr<grpc::Channel> channel) {
  absl::StatusOr<ListenAddress> address = ParseHostPort(options.listen);
  if (!address.ok()) return address.status();
  auto state = std::make_unique<State>(options, address->host, access, std::move(channel));
  HttpServerOptions http;
  http.max_held_bytes = std::max(http.max_held_bytes, options.max_message_bytes * 2);
  if (access.Tls() != nullptr) http.tls = [&access] { return access.Tls(); };
  auto server = HttpServer::Start(
      *address, std::move(http), [serving = state.get()](HttpExchange& exchange) { return serving->Handle(exchange); });
  if (!server.ok()) return server.status();
  state->server = *std::move(server);
  state->address = ToString(*address);
  return std::unique_ptr<WebPort>(new WebPort(std::move(state)));
}

}  // namespace dlcs

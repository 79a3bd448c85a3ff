// SPDX-License-Identifier: Apache-2.0
#include "server/telemetry/monitoring_pages.h"

#include <memory>
#include <utility>

namespace dlcs {
namespace {

HttpResponse Probe(const std::string& why_not) {
  return why_not.empty() ? TextResponse(200, "ok\n") : TextResponse(503, why_not + "\n");
}

HttpResponse ResponseTo(const HttpRequest& request, const MonitoringPages& pages) {
  if (request.method != "GET" && request.method != "HEAD") {
    HttpResponse refusal = TextResponse(405, "only GET and HEAD are served here\n");
    refusal.headers.emplace_back("allow", "GET, HEAD");
    return refusal;
  }
  if (request.path == "/metrics") {
    return {.status = 200,
            .headers = {{"content-type", "text/plain; version=0.0.4; charset=utf-8"}},
            .body = pages.metrics()};
  }
  if (request.path == "/livez") return TextResponse(200, "ok\n");
  if (request.path == "/readyz") return Probe(pages.why_not_ready());
  if (request.path == "/readyz/jobs") return Probe(pages.why_no_jobs());
  return TextResponse(404, "there are /metrics, /livez, /readyz and /readyz/jobs\n");
}

}  // namespace

HttpHandler NewMonitoringHandler(MonitoringPages pages) {
  return [kept = std::make_shared<const MonitoringPages>(std::move(pages))](
             HttpExchange& exchange) -> boost::asio::awaitable<void> {
    return exchange.Reply(ResponseTo(exchange.request(), *kept));
  };
}

}  // namespace dlcs

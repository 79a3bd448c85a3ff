// SPDX-License-Identifier: Apache-2.0
// The pages for monitoring: /metrics, /livez, /readyz, /readyz/jobs.

#ifndef DLCS_SERVER_TELEMETRY_MONITORING_PAGES_H_
#define DLCS_SERVER_TELEMETRY_MONITORING_PAGES_H_

#include <functional>
#include <string>

#include "server/http/http_server.h"

namespace dlcs {

// The contents of the pages. Called from threads of the HTTP server.
struct MonitoringPages {
  std::function<std::string()> metrics;
  std::function<std::string()> why_not_ready;  // why the server cannot serve calls; empty if it can
  std::function<std::string()> why_no_jobs;    // why it cannot run jobs; empty if it can
};

// Serves them without authentication; they show nothing about problems or users.
HttpHandler NewMonitoringHandler(MonitoringPages pages);

}  // namespace dlcs

#endif  // DLCS_SERVER_TELEMETRY_MONITORING_PAGES_H_

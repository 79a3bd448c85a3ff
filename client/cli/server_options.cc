// SPDX-License-Identifier: Apache-2.0
#include "client/cli/server_options.h"

namespace dlcs::client {

void AddServer(CLI::App& app, ServerTarget& target, const std::string& help) {
  CLI::Option* const server = app.add_option("--server", target.address, help)->type_name("HOST:PORT");
  CLI::Option* const with_server[] = {
      app.add_option("--token-file", target.token_file,
                     "Who you are, to the server: the file with your token (the environment's DLCS_TOKEN)"),
      app.add_option("--tls-ca", target.tls_ca, "Encrypt; trust servers of the authorities in this PEM file"),
      app.add_flag("--tls", target.tls, "Encrypt; trust the authorities that this machine trusts"),
      app.add_option("--tls-cert", target.tls_cert, "Encrypt; your certificate, PEM, for servers that want one"),
      app.add_option("--tls-key", target.tls_key, "Its private key, PEM"),
  };
  for (CLI::Option* option : with_server) {
    if (option->get_name() != "--tls") option->type_name("FILE");
    // Where a command can also run in this process, they say nothing without a server.
    if (target.address.empty()) option->needs(server);
  }
}

}  // namespace dlcs::client

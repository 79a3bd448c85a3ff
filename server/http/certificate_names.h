// SPDX-License-Identifier: Apache-2.0
// The identity of a client, from its certificate.

#ifndef DLCS_SERVER_HTTP_CERTIFICATE_NAMES_H_
#define DLCS_SERVER_HTTP_CERTIFICATE_NAMES_H_

#include <openssl/ossl_typ.h>

#include <string>
#include <vector>

namespace dlcs {

// The common names and the alternative names (hosts, IP and e-mail addresses, URIs), as in gRPC's properties of a peer.
std::vector<std::string> NamesIn(X509& certificate);

}  // namespace dlcs

#endif  // DLCS_SERVER_HTTP_CERTIFICATE_NAMES_H_

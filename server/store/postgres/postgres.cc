// SPDX-License-Identifier: Apache-2.0
#include "server/store/postgres/postgres.h"

#include <endian.h>
#include <libpq-fe.h>
#include <poll.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace dlcs::jobs {
namespace {

// Numbers of types, fixed by PostgreSQL (catalog/pg_type.dat).
constexpr unsigned kBytea = 17, kBigint = 20, kText = 25, kDouble = 701;

// A shutdown waits for it.
constexpr std::chrono::seconds kLongestConnecting{5};

// Less than it takes to notice that a primary is lost and to promote its standby.
constexpr std::chrono::seconds kConfirmedFor{1};

using Result = std::unique_ptr<PGresult, void (*)(PGresult*)>;

// libpq's messages have several lines and end with a newline.
std::string OnOneLine(const char* text) {
  std::string line;
  for (const char* c = text == nullptr ? "" : text; *c != 0; ++c) {
    const bool is_blank = *c == '\n' || *c == '\t' || *c == ' ';
    if (!is_blank) {
      line += *c;
    } else if (!line.empty() && line.back() != ' ') {
      line += ' ';
    }
  }
  if (!line.empty() && line.back() == ' ') line.pop_back();
  return line;
}

bool IsAnswer(const PGresult* result) {
  const ExecStatusType status = PQresultStatus(result);
  return status == PGRES_TUPLES_OK || status == PGRES_COMMAND_OK;
}

PostgresError ErrorOf(const PGresult* result) {
  const char* sqlstate = PQresultErrorField(result, PG_DIAG_SQLSTATE);
  const char* text = PQresultErrorField(result, PG_DIAG_MESSAGE_PRIMARY);
  return {sqlstate == nullptr ? "" : sqlstate, OnOneLine(text == nullptr ? PQresultErrorMessage(result) : text)};
}

std::string Seconds(Duration duration) {
  return std::to_string(std::chrono::duration_cast<std::chrono::seconds>(duration).count());
}

}  // namespace

void PostgresValues::AddPointer(unsigned type, const char* data, std::size_t size, bool is_binary) {
  types_.push_back(type);
  data_.push_back(data);
  sizes_.push_back(static_cast<int>(size));
  formats_.push_back(is_binary ? 1 : 0);
}

void PostgresValues::AddNumber(unsigned type, std::uint64_t bits) {
  bits = htobe64(bits);
  std::memcpy(numbers_.emplace_back().data(), &bits, sizeof bits);
  AddPointer(type, numbers_.back().data(), sizeof bits, true);
}

void PostgresValues::Add(std::int64_t value) { AddNumber(kBigint, static_cast<std::uint64_t>(value)); }

void PostgresValues::Add(double value) { AddNumber(kDouble, std::bit_cast<std::uint64_t>(value)); }

void PostgresValues::Add(const std::string& value) { AddPointer(kText, value.data(), value.size(), true); }

void PostgresValues::Add(Bytea value) {
  // A null pointer would make it NULL.
  AddPointer(kBytea, value.bytes.empty() ? "" : value.bytes.data(), value.bytes.size(), true);
}

void PostgresValues::Add(const std::optional<Time>& value) {
  if (value.has_value()) {
    Add(*value);
  } else {
    AddPointer(kBigint, nullptr, 0, true);
  }
}

void PostgresValues::Add(const std::optional<std::string>& value) {
  if (value.has_value()) {
    Add(*value);
  } else {
    AddPointer(kText, nullptr, 0, true);
  }
}

void PostgresRows::Clear(pg_result* result) { PQclear(result); }

int PostgresRows::size() const { return PQntuples(result_.get()); }

std::int64_t PostgresRows::changed() const { return std::atoll(PQcmdTuples(result_.get())); }

bool PostgresRows::IsNull(int row, int column) const { return PQgetisnull(result_.get(), row, column) != 0; }

std::uint64_t PostgresRows::Bits(int row, int column) const {
  std::uint64_t bits = 0;
  if (PQgetlength(result_.get(), row, column) != sizeof bits) {
    throw PostgresError("42804", "a column does not have the type that this program gave it");
  }
  std::memcpy(&bits, PQgetvalue(result_.get(), row, column), sizeof bits);
  return be64toh(bits);
}

std::int64_t PostgresRows::Int(int row, int column) const { return static_cast<std::int64_t>(Bits(row, column)); }

double PostgresRows::Real(int row, int column) const { return std::bit_cast<double>(Bits(row, column)); }

std::string PostgresRows::Bytes(int row, int column) const {
  return {PQgetvalue(result_.get(), row, column), static_cast<std::size_t>(PQgetlength(result_.get(), row, column))};
}

std::optional<Time> PostgresRows::OptionalTime(int row, int column) const {
  if (IsNull(row, column)) return std::nullopt;
  return TimeAt(row, column);
}

PostgresConnection::PostgresConnection(const std::string& address, Duration patience) : patience_(patience) {
  const std::string connect_seconds = Seconds(std::min<Duration>(patience, kLongestConnecting));
  const std::string silent_milliseconds = Seconds(patience) + "000";
  // Parameters before dbname are defaults that the address may override. Keepalives and timeouts of unacknowledged data
  // detect a dead peer.
  const char* const keywords[] = {"application_name",
                                  "connect_timeout",
                                  "keepalives_idle",
                                  "keepalives_interval",
                                  "keepalives_count",
                                  "tcp_user_timeout",
                                  "dbname",
                                  "client_encoding",
                                  nullptr};
  const char* const values[] = {
      "dlcsd", connect_seconds.c_str(), "10", "5", "3", silent_milliseconds.c_str(), address.c_str(), "UTF8", nullptr};
  constexpr int kExpandName = 1;
  connection_ = PQconnectdbParams(keywords, values, kExpandName);
  if (PQstatus(connection_) != CONNECTION_OK || PQsetnonblocking(connection_, 1) != 0) {
    const std::string text = OnOneLine(PQerrorMessage(connection_));
    PQfinish(connection_);
    throw PostgresError("", text);
  }
  PQsetNoticeReceiver(connection_, &Notice, this);
}

void PostgresConnection::Notice(void* connection, const pg_result* notice) {
  // Others ("relation exists, skipping") are of no interest.
  const char* severity = PQresultErrorField(notice, PG_DIAG_SEVERITY_NONLOCALIZED);
  if (severity == nullptr || std::string_view(severity) != "WARNING") return;
  static_cast<PostgresConnection*>(connection)->warning_ =
      OnOneLine(PQresultErrorField(notice, PG_DIAG_MESSAGE_PRIMARY));
}

PostgresConnection::~PostgresConnection() { PQfinish(connection_); }

void PostgresConnection::ThrowLost() const { throw PostgresError("", OnOneLine(PQerrorMessage(connection_))); }

void PostgresConnection::Wait(bool to_write) {
  pollfd watched{.fd = PQsocket(connection_), .events = POLLIN, .revents = 0};
  if (to_write) watched.events |= POLLOUT;
  const auto timeout = std::chrono::duration_cast<std::chrono::milliseconds>(patience_);
  int ready = 0;
  do {
    ready = poll(&watched, 1, static_cast<int>(timeout.count()));
  } while (ready < 0 && errno == EINTR);
  if (ready == 0) throw PostgresError("", "no response of the database server for " + Seconds(patience_) + " s");
  if (ready < 0) throw PostgresError("", std::strerror(errno));
}

void PostgresConnection::Flush() {
  for (int left = PQflush(connection_); left != 0; left = PQflush(connection_)) {
    if (left < 0) ThrowLost();
    Wait(true);
    // The server may have to send something before it reads more.
    if (PQconsumeInput(connection_) == 0) ThrowLost();
  }
}

PostgresRows PostgresConnection::Receive() {
  Result last(nullptr, PQclear);
  Result failed(nullptr, PQclear);
  for (;;) {
    while (PQisBusy(connection_) != 0) {
      Wait(false);
      if (PQconsumeInput(connection_) == 0) ThrowLost();
    }
    Result result(PQgetResult(connection_), PQclear);
    if (result == nullptr) break;
    if (!IsAnswer(result.get()) && failed == nullptr) {
      failed = std::move(result);
    } else {
      last = std::move(result);
    }
  }
  if (failed != nullptr) throw ErrorOf(failed.get());
  if (last == nullptr) ThrowLost();
  return PostgresRows(last.release());
}

PostgresRows PostgresConnection::RunWith(const std::string& sql, const PostgresValues& values) {
  constexpr int kBinary = 1;
  if (PQsendQueryParams(connection_, sql.c_str(), static_cast<int>(values.data_.size()), values.types_.data(),
                        values.data_.data(), values.sizes_.data(), values.formats_.data(), kBinary) == 0) {
    ThrowLost();
  }
  Flush();
  return Receive();
}

void PostgresConnection::Execute(const std::string& script) {
  if (PQsendQuery(connection_, script.c_str()) == 0) ThrowLost();
  Flush();
  Receive();
}

void PostgresConnection::RunConfirmed(const std::string& sql) {
  const auto begin = std::chrono::steady_clock::now();
  TakeWarning();
  Run(sql);
  // At a commit a server warns of nothing else.
  if (const std::string warning = TakeWarning(); !warning.empty()) throw PostgresError("", warning);
  confirmed_ = begin;
}

void PostgresConnection::Confirm() {
  if (std::chrono::steady_clock::now() - confirmed_ < kConfirmedFor) return;
  // Writes a record to the log that nothing reads, and changes no row, which others may have locked.
  RunConfirmed(
      "SELECT pg_logical_emit_message(true, 'dlcs', '')::text"
      " WHERE current_setting('synchronous_standby_names') <> ''");
}

bool PostgresConnection::IsAlive() {
  if (PQstatus(connection_) != CONNECTION_OK || PQtransactionStatus(connection_) != PQTRANS_IDLE) return false;
  // A server without a pending statement sends nothing but the end of the connection.
  pollfd watched{.fd = PQsocket(connection_), .events = POLLIN, .revents = 0};
  return poll(&watched, 1, 0) == 0;
}

bool PostgresConnection::InTransaction() const {
  const PGTransactionStatusType status = PQtransactionStatus(connection_);
  return status == PQTRANS_INTRANS || status == PQTRANS_INERROR;
}

int PostgresConnection::socket() const { return PQsocket(connection_); }

std::vector<std::string> PostgresConnection::TakeNotifications() {
  if (PQconsumeInput(connection_) == 0) ThrowLost();
  std::vector<std::string> payloads;
  for (;;) {
    const std::unique_ptr<PGnotify, void (*)(void*)> notification(PQnotifies(connection_), PQfreemem);
    if (notification == nullptr) return payloads;
    payloads.emplace_back(notification->extra);
  }
}

PostgresTransaction::PostgresTransaction(PostgresConnection& connection) : connection_(connection) {
  // Independent of the database's defaults: transitions lock the rows that they change.
  connection_.Run("BEGIN ISOLATION LEVEL READ COMMITTED READ WRITE");
}

PostgresTransaction::~PostgresTransaction() {
  if (!connection_.InTransaction()) return;
  try {
    connection_.Run("ROLLBACK");
  } catch (const PostgresError&) {
    // The connection is gone, and its transaction with it.
  }
}

void PostgresTransaction::Commit() { connection_.RunConfirmed("COMMIT"); }

}  // namespace dlcs::jobs

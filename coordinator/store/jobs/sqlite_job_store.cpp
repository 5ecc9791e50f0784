#include <fmt/format.h>
#include <sqlite3.h>

#include <atomic>
#include <memory>

#include "coordinator/base/limits.h"
#include "coordinator/store/jobs/job_store.h"
#include "core/base/guarded.h"

namespace ls::coordinator {
namespace {

constexpr int kSchemaVersion = 1;
constexpr const char* kSchema = R"(
CREATE TABLE IF NOT EXISTS jobs(ordinal INTEGER PRIMARY KEY, id TEXT UNIQUE NOT NULL, state TEXT NOT NULL, record TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS points(n INTEGER PRIMARY KEY, job TEXT NOT NULL, seconds REAL, core_seconds REAL, spp REAL,
  rmse REAL, relmse REAL, relmse_lo REAL, relmse_hi REAL, rmse_lo REAL, rmse_hi REAL);
CREATE INDEX IF NOT EXISTS points_of_job ON points(job);
CREATE TABLE IF NOT EXISTS truths(job TEXT NOT NULL, spp REAL NOT NULL, rmse REAL, relmse REAL, flip REAL,
  mse_stderr REAL, relmse_stderr REAL, PRIMARY KEY(job, spp));
CREATE TABLE IF NOT EXISTS log(n INTEGER PRIMARY KEY, job TEXT NOT NULL, unix REAL, text TEXT);
CREATE INDEX IF NOT EXISTS log_of_job ON log(job);
CREATE TABLE IF NOT EXISTS barred(worker TEXT PRIMARY KEY, evidence TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS counters(name TEXT PRIMARY KEY, value INTEGER NOT NULL);
)";

using Db = std::unique_ptr<sqlite3, decltype([](sqlite3* db) { sqlite3_close_v2(db); })>;

Error db_error(sqlite3* db, std::string_view what) {
  const int code = sqlite3_errcode(db);
  if (code == SQLITE_FULL)
    return {Errc::resource_exhausted,
            fmt::format("the disk is full: cannot {} ({}); free some space and try again", what,
                        sqlite3_errmsg(db))};
  return {Errc::unavailable, fmt::format("cannot {}: {}", what, sqlite3_errmsg(db))};
}

// One SQL statement with its parameters.
class Statement {
 public:
  template <class... Parameters>
  Statement(const Db& db, const char* sql, const Parameters&... parameters) : db_(db.get()) {
    sqlite3_stmt* raw = nullptr;
    sqlite3_prepare_v2(db.get(), sql, -1, &raw, nullptr);
    statement_.reset(raw);
    (bind(parameters), ...);
  }
  // Runs the statement up to its next row. True: there is a row; false: there are no more rows.
  Result<bool> step(std::string_view what) {
    const int code = statement_ ? sqlite3_step(statement_.get()) : SQLITE_ERROR;
    if (code == SQLITE_ROW) return true;
    if (code == SQLITE_DONE) return false;
    return tl::unexpected(db_error(db_, what));
  }
  Result<void> run(std::string_view what) {
    auto stepped = step(what);
    while (stepped && *stepped) stepped = step(what);
    if (!stepped) return tl::unexpected(stepped.error());
    return {};
  }
  // Runs the statement and returns the result of read() for each row.
  template <class Read>
  Result<std::vector<std::invoke_result_t<Read>>> all(std::string_view what, Read read) {
    std::vector<std::invoke_result_t<Read>> rows;
    auto row = step(what);
    for (; row && *row; row = step(what)) rows.push_back(read());
    if (!row) return tl::unexpected(row.error());
    return rows;
  }
  std::string text(int column) const {
    const auto* chars = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
    return chars
               ? std::string(chars, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column)))
               : "";
  }
  double real(int column) const { return sqlite3_column_double(statement_.get(), column); }
  bool null(int column) const { return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL; }
  std::optional<double> known(int column) const {
    return null(column) ? std::nullopt : std::optional(real(column));
  }
  std::int64_t integer(int column) const { return sqlite3_column_int64(statement_.get(), column); }

 private:
  void bind(std::string_view text) {
    sqlite3_bind_text(statement_.get(), ++bound_, text.data(), static_cast<int>(text.size()),
                      SQLITE_TRANSIENT);
  }
  void bind(double value) { sqlite3_bind_double(statement_.get(), ++bound_, value); }
  void bind(const std::optional<double>& value) {
    if (!value) return void(++bound_);  // SQLite takes NULL for a parameter that is not bound
    bind(*value);
  }
  void bind(std::int64_t value) { sqlite3_bind_int64(statement_.get(), ++bound_, value); }

  sqlite3* db_;
  std::unique_ptr<sqlite3_stmt, decltype([](sqlite3_stmt* s) { sqlite3_finalize(s); })> statement_;
  int bound_ = 0;
};

Result<void> execute(const Db& db, const char* sql, std::string_view what) {
  if (sqlite3_exec(db.get(), sql, nullptr, nullptr, nullptr) != SQLITE_OK)
    return tl::unexpected(db_error(db.get(), what));
  return {};
}

// Runs `work` in one transaction, which is rolled back on an error.
template <class Work>
Result<void> all_or_nothing(const Db& db, const char* what, Work work) {
  if (auto begun = execute(db, "BEGIN IMMEDIATE", what); !begun) return begun;
  auto done = work();
  if (done) done = execute(db, "COMMIT", what);
  if (!done) (void)execute(db, "ROLLBACK", "take back what was begun");
  return done;
}

Result<void> put(const Db& db, const StoredJob& job) {
  return Statement(db,
                   "INSERT INTO jobs(id, state, record) VALUES(?1, ?2, ?3) "
                   "ON CONFLICT(id) DO UPDATE SET state = ?2, record = ?3",
                   job.id.value, to_string(job.state), to_json(job))
      .run("store a job");
}

StoredJob damaged_job(std::string id, const Error& why) {
  StoredJob job;
  job.id.value = std::move(id);
  job.state = JobState::failed;
  job.error =
      why.message +
      "; start the newer version, take the database from a backup, or delete the job and submit it again";
  job.damaged = true;
  return job;
}

class SqliteJobStore final : public JobStore {
 public:
  explicit SqliteJobStore(Db db) : db_(std::move(db)) {}

  Result<void> put_jobs(std::span<const StoredJob> jobs) override {
    const auto db = db_.lock();
    return all_or_nothing(*db, jobs.size() == 1 ? "store a job" : "store jobs", [&]() -> Result<void> {
      for (const StoredJob& job : jobs)
        if (auto done = put(*db, job); !done) return done;
      return {};
    });
  }

  Result<std::vector<StoredJob>> jobs() const override {
    const auto db = db_.lock();
    Statement rows(*db, "SELECT record, id FROM jobs ORDER BY ordinal");
    return rows.all("read the jobs", [&] {
      auto job = parse_stored_job(rows.text(0));
      return job ? std::move(*job) : damaged_job(rows.text(1), job.error());
    });
  }

  Result<void> remove_jobs(std::span<const JobId> jobs) override {
    const auto db = db_.lock();
    return all_or_nothing(*db, "remove a job", [&]() -> Result<void> {
      for (const JobId& job : jobs)
        for (const char* sql : {"DELETE FROM jobs WHERE id = ?", "DELETE FROM points WHERE job = ?",
                                "DELETE FROM truths WHERE job = ?", "DELETE FROM log WHERE job = ?"})
          if (auto done = Statement(*db, sql, job.value).run("remove a job"); !done) return done;
      return {};
    });
  }

  Result<void> add_point(const JobId& job, const ConvergencePoint& p) override {
    const auto db = db_.lock();
    return Statement(
               *db,
               "INSERT INTO points(job, seconds, core_seconds, spp, rmse, relmse, relmse_lo, relmse_hi, "
               "rmse_lo, rmse_hi) VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
               job.value, p.seconds, p.core_seconds, p.spp, p.error.rmse, p.error.relmse, p.error.relmse_lo,
               p.error.relmse_hi, p.error.rmse_lo, p.error.rmse_hi)
        .run("store a convergence point");
  }

  Result<void> set_reference_error(const JobId& job, double spp,
                                   const ReferenceError& reference_error) override {
    const auto db = db_.lock();
    return Statement(*db,
                     "INSERT OR REPLACE INTO truths(job, spp, rmse, relmse, flip, mse_stderr, relmse_stderr) "
                     "VALUES(?, ?, ?, ?, ?, ?, ?)",
                     job.value, spp, reference_error.rmse, reference_error.relmse, reference_error.flip,
                     reference_error.mse_stderr, reference_error.relmse_stderr)
        .run("store a comparison with the reference");
  }

  Result<std::vector<ConvergencePoint>> points(const JobId& job) const override {
    const auto db = db_.lock();
    Statement rows(*db,
                   "SELECT seconds, core_seconds, spp, points.rmse, points.relmse, relmse_lo, relmse_hi, "
                   "truths.rmse, truths.relmse, truths.flip, rmse_lo, rmse_hi, mse_stderr, relmse_stderr "
                   "FROM points LEFT JOIN truths USING(job, spp) WHERE job = ? ORDER BY n",
                   job.value);
    return rows.all("read the convergence", [&] {
      ConvergencePoint p{
          rows.real(0),
          rows.real(1),
          rows.real(2),
          {rows.real(3), rows.real(4), rows.real(5), rows.real(6), rows.real(10), rows.real(11)}};
      if (!rows.null(7))
        p.reference_error =
            ReferenceError{rows.real(7), rows.real(8), rows.known(9), rows.known(12), rows.known(13)};
      return p;
    });
  }

  Result<void> remove_points(const JobId& job) override {
    const auto db = db_.lock();
    return all_or_nothing(*db, "remove the convergence of a job", [&]() -> Result<void> {
      for (const char* sql : {"DELETE FROM points WHERE job = ?", "DELETE FROM truths WHERE job = ?"})
        if (auto done = Statement(*db, sql, job.value).run("remove the convergence of a job"); !done)
          return done;
      return {};
    });
  }

  Result<void> add_log(const JobId& job, const LogLine& line) override {
    const auto db = db_.lock();
    if (auto done = Statement(*db, "INSERT INTO log(job, unix, text) VALUES(?, ?, ?)", job.value,
                              line.unix_time, line.text)
                        .run("store a log line");
        !done)
      return done;
    if (++log_lines_ % limits::kLogLinesKept != 0) return {};
    return Statement(*db,
                     "DELETE FROM log WHERE job = ?1 AND n NOT IN "
                     "(SELECT n FROM log WHERE job = ?1 ORDER BY n DESC LIMIT ?2)",
                     job.value, static_cast<std::int64_t>(limits::kLogLinesKept))
        .run("shorten a log");
  }

  Result<std::vector<LogLine>> log(const JobId& job) const override {
    const auto db = db_.lock();
    Statement rows(
        *db,
        "SELECT unix, text FROM (SELECT n, unix, text FROM log WHERE job = ? ORDER BY n DESC LIMIT ?) "
        "ORDER BY n",
        job.value, static_cast<std::int64_t>(limits::kLogLinesKept));
    return rows.all("read a log", [&] { return LogLine{rows.real(0), rows.text(1)}; });
  }

  Result<void> quarantine(const QuarantinedWorker& worker) override {
    const auto db = db_.lock();
    return Statement(*db, "INSERT OR IGNORE INTO barred(worker, evidence) VALUES(?, ?)", worker.worker.value,
                     worker.evidence)
        .run("store that a worker is quarantined");
  }
  Result<std::vector<QuarantinedWorker>> quarantined() const override {
    const auto db = db_.lock();
    Statement rows(*db, "SELECT worker, evidence FROM barred ORDER BY worker");
    return rows.all("read the quarantined workers", [&] {
      return QuarantinedWorker{{rows.text(0)}, rows.text(1)};
    });
  }

  Result<std::uint64_t> reserve(const std::string& counter, std::uint64_t amount) override {
    const auto db = db_.lock();
    Statement row(*db,
                  "INSERT INTO counters(name, value) VALUES(?1, ?2) "
                  "ON CONFLICT(name) DO UPDATE SET value = value + ?2 RETURNING value",
                  counter, static_cast<std::int64_t>(amount));
    const auto stepped = row.step("reserve ids");
    if (!stepped) return tl::unexpected(stepped.error());
    const auto value = static_cast<std::uint64_t>(row.integer(0));
    if (auto done = row.run("reserve ids"); !done) return tl::unexpected(done.error());
    return value - amount;
  }

 private:
  mutable Guarded<Db> db_;
  std::atomic<std::uint64_t> log_lines_{0};
};

}  // namespace

Result<std::unique_ptr<JobStore>> open_sqlite_job_store(const std::filesystem::path& file) {
  sqlite3* raw = nullptr;
  const int code = sqlite3_open_v2(
      file.c_str(), &raw, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_FULLMUTEX, nullptr);
  Db db(raw);
  const std::string what = fmt::format("open the job database {}", file.string());
  if (code != SQLITE_OK) return tl::unexpected(db_error(raw, what));
  // Waits up to 5 s if the file is locked. Only the coordinator uses it regularly, but a backup may lock it.
  sqlite3_busy_timeout(raw, 5000);
  // synchronous must be FULL: with NORMAL, a power failure could undo changes that were already acknowledged.
  for (const char* sql :
       {"PRAGMA journal_mode = WAL", "PRAGMA synchronous = FULL", "PRAGMA foreign_keys = ON"})
    if (auto done = execute(db, sql, what); !done) return tl::unexpected(done.error());
  Statement version(db, "PRAGMA user_version");
  if (auto row = version.step(what); !row) return tl::unexpected(row.error());
  if (const auto found = version.integer(0); found > kSchemaVersion)
    return fail(
        Errc::failed_precondition,
        fmt::format(
            "{} was written by a newer Lightshaft (schema {}, this one knows {}); use that one, or another "
            "--data folder",
            file.string(), found, kSchemaVersion));
  if (auto done = version.run(what); !done) return tl::unexpected(done.error());
  if (auto done = execute(db, kSchema, what); !done) return tl::unexpected(done.error());
  if (auto done = execute(db, fmt::format("PRAGMA user_version = {}", kSchemaVersion).c_str(), what); !done)
    return tl::unexpected(done.error());
  return std::make_unique<SqliteJobStore>(std::move(db));
}

}  // namespace ls::coordinator

import { useQuery } from "@tanstack/react-query";
import { api } from "../../lib/api/client";
import { formatDayOf, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { MetricLink } from "../../ui/Metric";
import { useHasPermission } from "../auth/hooks";
import { useCommissioningStatus } from "../commissioning/CommissioningState";
import { describeStop } from "../sessions/describeStop";
import { UNSIGNED } from "../sessions/sessionFilters";
import { mostFrequentCause } from "../statistics/causes";
import { describeDrift } from "../statistics/drift";
import { daysOf, describeSpan, spanOf } from "../statistics/figuresSearch";
import { describeHours } from "../statistics/hours";

const GIGA = 1e9;
const MEGA = 1e6;
/** Share of free space below which the tile warns. The service's own checks are stricter. */
const LITTLE_SPACE = 0.1;

const size = (bytes: number) =>
  bytes >= GIGA
    ? t("home:tiles.gigabytes", { value: (bytes / GIGA).toFixed(1) })
    : t("home:tiles.megabytes", { value: (bytes / MEGA).toFixed(0) });

/** The period of each tile, and of the page behind it. */
const PERIODS = {
  usage: { range: "days7", by: "day" },
  stops: { range: "weeks4" },
  tracking: { range: "weeks4" },
} as const;

export function UsageTile() {
  const { data, isError } = useQuery({
    queryKey: ["usage", "tile"],
    queryFn: () => api.usage(spanOf(PERIODS.usage, new Date()), PERIODS.usage.by),
  });
  const sum = (amount: "sessions" | "repetitions") =>
    (data?.rows ?? []).reduce((total, row) => total + row[amount], 0);
  return (
    <MetricLink
      to="/clinic/$subject"
      params={{ subject: "usage" }}
      search={PERIODS.usage}
      label={t("home:tiles.usage")}
      value={data && String(sum("sessions"))}
      unit={t("home:tiles.sessions", { count: sum("sessions") })}
      note={
        data
          ? t("home:tiles.usageDetail", { hours: describeHours(data.rows), repetitions: sum("repetitions") })
          : ""
      }
      failed={isError}
    />
  );
}

export function StopsTile() {
  const { data, isError } = useQuery({
    queryKey: ["stops", "tile"],
    queryFn: () => api.stopCounts(spanOf(PERIODS.stops, new Date())),
  });
  const most = data && mostFrequentCause(data.rows);
  const days = describeSpan(daysOf(PERIODS.stops, new Date()));
  const cause = most ? t("home:tiles.stopsDetail", { cause: describeStop(most) }) : t("home:tiles.stopsNone");
  return (
    <MetricLink
      to="/clinic/$subject"
      params={{ subject: "stops" }}
      search={PERIODS.stops}
      label={t("home:tiles.stops")}
      value={
        data &&
        t("statistics:figures.ofSessions", { stopped: data.stopped_sessions, sessions: data.sessions })
      }
      unit={t("home:tiles.sessions", { count: data?.sessions ?? 0 })}
      note={data ? t("home:tiles.inDays", { days, note: cause }) : ""}
      failed={isError}
    />
  );
}

export function TrackingTile() {
  const { data, isError } = useQuery({
    queryKey: ["tracking", "tile"],
    queryFn: () => api.trackingQuality(spanOf(PERIODS.tracking, new Date())),
  });
  return (
    <MetricLink
      to="/clinic/$subject"
      params={{ subject: "tracking" }}
      search={PERIODS.tracking}
      label={t("home:tiles.tracking")}
      value={data && describeDrift(data.drift)}
      note={t("statistics:figures.trackingDetail")}
      needsAttention={data?.drift.some((station) => station.drifting) ?? false}
      failed={isError}
    />
  );
}

/** The service counts at most this many unsigned notes. */
const MOST_UNSIGNED = 1000;

export function UnsignedTile() {
  const { data, isError } = useQuery({ queryKey: ["worklist"], queryFn: api.worklist });
  const count = data?.unsigned_count ?? 0;
  const more = count >= MOST_UNSIGNED;
  return (
    <MetricLink
      to="/sessions"
      search={{ note: UNSIGNED }}
      label={t("home:tiles.unsigned")}
      value={data && (more ? t("home:tiles.unsignedMore", { count }) : String(count))}
      {...(!more && { unit: t("home:tiles.unsignedUnit", { count }) })}
      note={t("home:tiles.unsignedDetail")}
      failed={isError}
    />
  );
}

export function BreakGlassAccessesTile() {
  // Accesses that wait for a review come first. If the first page is full of them, there may be more.
  const { data, isError } = useQuery({
    queryKey: ["break-glass-accesses", "tile"],
    queryFn: () => api.breakGlassAccesses(),
  });
  const waiting = (data?.items ?? []).filter((access) => access.reviewed_at === null).length;
  const more = data?.next !== null && waiting === data?.items.length;
  return (
    <MetricLink
      to="/administration/emergency-access"
      label={t("home:tiles.breakGlassAccesses")}
      value={data && (more ? t("home:tiles.breakGlassAccessesMore", { count: waiting }) : String(waiting))}
      {...(!more && { unit: t("home:tiles.breakGlassAccessesUnit", { count: waiting }) })}
      note={t("home:tiles.breakGlassAccessesDetail")}
      needsAttention={waiting > 0}
      failed={isError}
    />
  );
}

export function BackupTile() {
  const { data, isError } = useQuery({ queryKey: ["backups", "tile"], queryFn: () => api.backups() });
  const failed = Boolean(data?.items[0]?.failure);
  const next = data?.next_at ? t("home:tiles.backupNext", { moment: formatMoment(data.next_at) }) : "";
  return (
    <MetricLink
      to="/administration/backups"
      label={t("home:tiles.backup")}
      value={data && (data.last_good ? formatMoment(data.last_good.at) : t("home:tiles.backupNone"))}
      note={failed ? t("home:tiles.backupFailed") : next}
      needsAttention={failed || data?.last_good === null}
      failed={isError}
    />
  );
}

export function CommissioningTile() {
  const { data, isError } = useCommissioningStatus();
  const simulated = data?.state === "not_needed" ? t("home:tiles.simulated") : "";
  const detail = data?.due_at ? t("home:tiles.checkDue", { day: formatDayOf(data.due_at) }) : simulated;
  return (
    <MetricLink
      to="/commissioning"
      label={t("home:tiles.commissioning")}
      value={data && t(`home:tiles.commissioningStates.${data.state}`)}
      note={data?.reason ? translateServerText(data.reason, data.reason_key) : detail}
      needsAttention={data?.state === "due" || data?.state === "not_commissioned"}
      failed={isError}
    />
  );
}

export function StorageTile() {
  const canAdminister = useHasPermission("administer");
  const { data, isError } = useQuery({ queryKey: ["operation"], queryFn: () => api.operation() });
  const share = data ? data.disk_free_bytes / data.disk_bytes : 1;
  return (
    <MetricLink
      to={canAdminister ? "/administration/backups" : "/stations"}
      label={t("home:tiles.storage")}
      value={data && size(data.disk_free_bytes)}
      note={
        data
          ? t("home:tiles.storageDetail", {
              percent: (100 * share).toFixed(0),
              size: size(data.database_bytes),
              version: data.version,
            })
          : ""
      }
      needsAttention={share < LITTLE_SPACE}
      failed={isError}
    />
  );
}

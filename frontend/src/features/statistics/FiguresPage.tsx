import { Group, SegmentedControl, Select, Skeleton, Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { Link, Navigate, useNavigate, useParams, useSearch } from "@tanstack/react-router";
import classes from "../../app/Shell.module.css";
import { useTitle } from "../../app/title";
import { api, type Schemas } from "../../lib/api/client";
import { isDay, today } from "../../lib/days";
import { t } from "../../lib/i18n";
import { DateField } from "../../ui/DateField";
import { ProblemNote } from "../../ui/ProblemNote";
import { useHasPermission } from "../auth/hooks";
import { ChartCard } from "./ChartCard";
import { stopsFigure, stopsTable, usageFigure, usageTable } from "./charts";
import {
  AMOUNTS,
  daysOf,
  describeSpan,
  type FiguresSearch,
  RANGES,
  SUBJECTS,
  type Subject,
  spanOf,
} from "./figuresSearch";
import { describeHours } from "./hours";
import { Outcomes } from "./Outcomes";
import { PatientAdherence } from "./PatientAdherence";
import { StopsTable } from "./StopsTable";
import { Tracking } from "./Tracking";

const NEEDS = {
  outcomes: "read_records",
  adherence: "read_records",
  usage: "see_operation",
  stops: "see_operation",
  tracking: "see_operation",
} as const;
const FROM = "/clinic/$subject";

/** Redirects to the first figures that the user may see. */
export function FiguresEntry() {
  const canReadRecords = useHasPermission("read_records");
  return <Navigate to={FROM} params={{ subject: canReadRecords ? "outcomes" : "usage" }} replace />;
}

/**
 * The figures of the clinic: outcomes, adherence, use, stops and tracking error. The address contains time, filters and
 * choices.
 */
export function FiguresPage() {
  useTitle(t("statistics:figures.title"));
  const { subject: asked } = useParams({ from: FROM });
  const subject = SUBJECTS.find((name) => name === asked) ?? "outcomes";
  const search = useSearch({ from: FROM });
  const permitted = {
    read_records: useHasPermission("read_records"),
    see_operation: useHasPermission("see_operation"),
  };
  const shown = SUBJECTS.filter((name) => permitted[NEEDS[name]]);
  const Figures = {
    outcomes: Outcomes,
    adherence: PatientAdherence,
    usage: Usage,
    stops: Stops,
    tracking: Tracking,
  }[subject];
  return (
    <Stack>
      <Title order={1} size="h2">
        {t("statistics:figures.title")}
      </Title>
      <Group component="nav" gap={4} aria-label={t("statistics:figures.subjects")}>
        {shown.map((name) => (
          <Link
            key={name}
            to={FROM}
            params={{ subject: name }}
            search={({ from, to, range, station }: FiguresSearch) => ({
              ...(from && { from }),
              ...(to && { to }),
              ...(range && { range }),
              ...(station && { station }),
            })}
            className={classes.page ?? ""}
            activeProps={{ className: classes.here ?? "", "aria-current": "page" }}
            activeOptions={{ includeSearch: false }}
          >
            {t(`statistics:subjects.${name}.title`)}
          </Link>
        ))}
      </Group>
      {shown.includes(subject) ? (
        <>
          {/* Adherence is always that of the last four weeks. */}
          {subject !== "adherence" && <Choices subject={subject} search={search} />}
          <Text size="sm">{t(`statistics:subjects.${subject}.shows`)}</Text>
          <Figures search={search} />
        </>
      ) : (
        <Text>{t("statistics:figures.noRight")}</Text>
      )}
    </Stack>
  );
}

/** Lets the user choose time, station, interval and amount. */
function Choices({ subject, search }: { subject: Subject; search: FiguresSearch }) {
  const navigate = useNavigate({ from: FROM });
  const sees = useHasPermission("read_records");
  const options = useQuery({
    queryKey: ["session-choices"],
    queryFn: api.sessionFilterOptions,
    enabled: sees && subject !== "outcomes",
  });
  const days = daysOf(search, new Date());
  const set = (change: FiguresSearch) => void navigate({ search: { ...search, ...change }, replace: true });
  const { from: _, to: __, ...withoutDays } = search;
  const stations = options.data?.stations ?? [];
  const { station, ...everywhere } = search;
  return (
    <Group align="end">
      <Select
        label={t("statistics:figures.range")}
        allowDeselect={false}
        data={RANGES.map((range) => ({ value: range, label: t(`statistics:figures.ranges.${range}`) }))}
        value={search.from || search.to ? null : (search.range ?? "months12")}
        onChange={(range) =>
          void navigate({
            search: { ...withoutDays, range: range as (typeof RANGES)[number] },
            replace: true,
          })
        }
      />
      {(["from", "to"] as const).map((name) => (
        <DateField
          key={name}
          label={t(`statistics:figures.${name}`)}
          value={days[name]}
          max={today()}
          onChange={(day) => isDay(day) && set({ ...days, [name]: day })}
        />
      ))}
      {subject !== "outcomes" && sees && (
        <Select
          label={t("statistics:figures.station")}
          placeholder={t("statistics:figures.anyStation")}
          clearable
          data={station === undefined || stations.includes(station) ? stations : [...stations, station]}
          value={station ?? null}
          onChange={(chosen) =>
            void navigate({ search: chosen ? { ...search, station: chosen } : everywhere, replace: true })
          }
        />
      )}
    </Group>
  );
}

function Usage({ search }: { search: FiguresSearch }) {
  const navigate = useNavigate({ from: FROM });
  const { by, ...byWeek } = search;
  const span = spanOf(search, new Date());
  const usage = useQuery({ queryKey: ["usage", span, by], queryFn: () => api.usage(span, by ?? "week") });
  const rows = usage.data?.rows ?? [];
  const sum = (amount: "sessions" | "repetitions") => rows.reduce((total, row) => total + row[amount], 0);
  return (
    <Stack>
      <Group>
        <SegmentedControl
          aria-label={t("statistics:figures.of")}
          value={search.of ?? "sessions"}
          onChange={(of) =>
            void navigate({ search: { ...search, of: of as (typeof AMOUNTS)[number] }, replace: true })
          }
          data={AMOUNTS.map((amount) => ({ value: amount, label: t(`statistics:figures.${amount}`) }))}
        />
        <SegmentedControl
          aria-label={t("statistics:figures.by")}
          value={by ?? "week"}
          onChange={(chosen) =>
            void navigate({ search: chosen === "day" ? { ...search, by: "day" } : byWeek, replace: true })
          }
          data={(["week", "day"] as const).map((value) => ({
            value,
            label: t(`statistics:figures.${value}`),
          }))}
        />
      </Group>
      <ProblemNote error={usage.error} />
      {usage.isPending && <Skeleton h={520} />}
      {usage.data && rows.length === 0 && <Text>{t("statistics:figures.nothing")}</Text>}
      {rows.length > 0 && (
        <ChartCard
          name="usage"
          title={t("statistics:subjects.usage.title")}
          summary={t("statistics:figures.usageSummary", {
            days: describeSpan(daysOf(search, new Date())),
            sessions: sum("sessions"),
            hours: describeHours(rows),
            repetitions: sum("repetitions"),
          })}
          figure={usageFigure(rows, search)}
          table={usageTable(rows)}
        />
      )}
    </Stack>
  );
}

const NO_STOPS: Schemas["Stops"] = { rows: [], sessions: 0, stopped_sessions: 0 };

function Stops({ search }: { search: FiguresSearch }) {
  const span = spanOf(search, new Date());
  const stops = useQuery({ queryKey: ["stops", span], queryFn: () => api.stopCounts(span) });
  const { rows, sessions, stopped_sessions: stopped } = stops.data ?? NO_STOPS;
  const summary = t("statistics:figures.stopsSummary", {
    days: describeSpan(daysOf(search, new Date())),
    stopped: t("statistics:figures.ofSessions", { stopped, sessions }),
  });
  return (
    <Stack>
      <ProblemNote error={stops.error} />
      {stops.isPending && <Skeleton h={400} />}
      {stops.data && rows.length === 0 && (
        <Text>{sessions > 0 ? summary : t("statistics:figures.nothing")}</Text>
      )}
      {rows.length > 0 && (
        <>
          <ChartCard
            name="stops"
            title={t("statistics:subjects.stops.title")}
            summary={summary}
            figure={stopsFigure(rows)}
            table={stopsTable(rows)}
          />
          <StopsTable rows={rows} days={daysOf(search, new Date())} />
        </>
      )}
    </Stack>
  );
}

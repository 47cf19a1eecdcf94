import { Select, Skeleton, Stack, Text } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useNavigate } from "@tanstack/react-router";
import { api, type Schemas } from "../../lib/api/client";
import { formatDeg, formatList } from "../../lib/format";
import { t } from "../../lib/i18n";
import { Metric, Metrics } from "../../ui/Metric";
import { ProblemNote } from "../../ui/ProblemNote";
import { ChartCard } from "./ChartCard";
import { describeGroup, outcomeFigure, outcomeTable, shownGroups } from "./charts";
import { type FiguresSearch, MEASURES, type Measure, spanOf } from "./figuresSearch";
import { changeOfAll, hasPoints, wholePercent, withUnit } from "./outcomeFormat";

type Found = Schemas["Outcomes"];

/** Shows the outcomes of the treatment for all shoulders, by stage and by programme. */
export function Outcomes({ search }: { search: FiguresSearch }) {
  const navigate = useNavigate({ from: "/clinic/$subject" });
  const { station: _, ...span } = spanOf(search, new Date());
  const outcomes = useQuery({ queryKey: ["outcomes", span], queryFn: () => api.outcomes(span) });
  const measure = search.measure ?? "spadi";
  return (
    <Stack>
      <Select
        label={t("statistics:figures.measure")}
        maw={420}
        allowDeselect={false}
        data={MEASURES.map((value) => ({ value, label: t(`statistics:measures.${value}`) }))}
        value={measure}
        onChange={(chosen) =>
          void navigate({ search: { ...search, measure: chosen as Measure }, replace: true })
        }
      />
      <ProblemNote error={outcomes.error} />
      {outcomes.isPending && <Skeleton h={720} />}
      {outcomes.data && <Shown found={outcomes.data} measure={measure} />}
    </Stack>
  );
}

function Shown({ found, measure }: { found: Found; measure: Measure }) {
  const shown = shownGroups(found.groups, measure);
  const all = changeOfAll(found, measure);
  if (!all) return <Text>{t("statistics:figures.fewAll", { count: found.least_patients })}</Text>;
  const titleOf = (chart: "shareChart" | "meanChart") =>
    t("statistics:verdicts.titleOf", {
      chart: t(`statistics:verdicts.${chart}`),
      measure: t(`statistics:measures.${measure}`),
    });
  const hidden = found.groups.filter((group) => group.patients === null);
  const table = outcomeTable(found.groups);
  return (
    <>
      <Verdicts measure={measure} change={all} limits={found.limits[measure] ?? []} />
      {all.important && (
        <ChartCard
          name="outcomes"
          title={titleOf("shareChart")}
          summary={t("statistics:verdicts.improved", { percent: wholePercent(all.important.value) })}
          figure={outcomeFigure(shown, "important")}
          table={table}
        />
      )}
      <ChartCard
        name="outcomes"
        title={titleOf("meanChart")}
        summary={t("statistics:verdicts.mean", { change: withUnit(measure, all.change?.value) })}
        figure={outcomeFigure(
          shown,
          "change",
          t(`statistics:figures.changeAxis.${hasPoints(measure) ? "points" : "angle"}`),
        )}
        table={table}
      />
      {hidden.length > 0 && (
        <Text size="sm">
          {t("statistics:figures.hiddenGroups", {
            count: found.least_patients,
            groups: formatList(hidden.map(describeGroup)),
          })}
        </Text>
      )}
    </>
  );
}

function Verdicts(props: { measure: Measure; change: Schemas["OutcomeChange"]; limits: (number | null)[] }) {
  const { measure, change, limits } = props;
  const { important, detectable, weeks_to_important: weeks, change: mean } = change;
  const [importantLimit, detectableLimit] = limits.map((limit) => limit ?? 0) as [number, number];
  return (
    <Metrics label={t("statistics:subjects.outcomes.title")}>
      {important && (
        <Metric
          label={t("statistics:verdicts.improvedLabel")}
          value={t("statistics:figures.percent", { value: wholePercent(important.value) })}
          note={t("statistics:verdicts.improvedDetail", {
            limit_points: importantLimit,
            low: wholePercent(important.low),
            high: wholePercent(important.high),
            count: change.shoulders,
          })}
        />
      )}
      {detectable && (
        <Metric
          label={t("statistics:verdicts.detectable")}
          value={t("statistics:figures.percent", { value: wholePercent(detectable.value) })}
          note={t("statistics:verdicts.detectableDetail", {
            limit_points: detectableLimit,
            low: wholePercent(detectable.low),
            high: wholePercent(detectable.high),
            count: change.shoulders,
          })}
        />
      )}
      {mean && (
        <Metric
          label={t("statistics:verdicts.meanChart")}
          value={withUnit(measure, mean.value)}
          note={t("statistics:verdicts.meanDetail", {
            low: formatDeg(mean.low),
            high: withUnit(measure, mean.high),
            first: formatDeg(change.first),
            last: withUnit(measure, change.last),
            count: change.shoulders,
          })}
        />
      )}
      {weeks && (
        <Metric
          label={t("statistics:verdicts.weeks")}
          value={t("statistics:verdicts.weeksValue", { median: formatDeg(weeks[1]) })}
          note={t("statistics:verdicts.weeksDetail", { low: formatDeg(weeks[0]), high: formatDeg(weeks[2]) })}
        />
      )}
      {!important && <Text size="sm">{t("statistics:verdicts.noLimit")}</Text>}
    </Metrics>
  );
}

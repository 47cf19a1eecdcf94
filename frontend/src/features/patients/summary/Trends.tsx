import { SimpleGrid, Stack, Text, Title } from "@mantine/core";
import type { Assessment, Schemas } from "../../../lib/api/client";
import { formatMeasured } from "../../../lib/format";
import { t } from "../../../lib/i18n";
import { type Trend, TrendChart, TrendLegend } from "../../../ui/TrendChart";
import { NumbersTable } from "../../progress/NumbersTable";

/** Shows pain and SPADI over all assessments of the episode. `assessments`: newest first. `side`: the shoulder. */
export function Trends({ assessments, side }: { assessments: Assessment[]; side: "left" | "right" }) {
  const counted = assessments.filter(({ withdrawn_at }) => !withdrawn_at).reverse();
  const trend = (name: string, of: (assessment: Assessment) => number | null | undefined): Trend => ({
    name,
    points: counted.flatMap((assessment) => {
      const value = of(assessment);
      return typeof value === "number" ? [{ at: assessment.assessed_at, value }] : [];
    }),
  });
  const pains = [
    trend(t("assessments:pains.pain_average"), (one) => one.pain_average),
    trend(t("assessments:pains.pain_active"), (one) => one.pain_active),
  ].filter(({ points }) => points.length > 0);
  const spadi = [trend(t("patients:summary.spadi"), (one) => one.spadi_score?.total)].filter(
    ({ points }) => points.length > 0,
  );
  const title = (what: string) =>
    t("patients:summary.ofShoulder", { what, shoulder: t(`episodes:care.shoulder.${side}`) });
  const all = [...pains, ...spadi];
  return (
    <Stack gap="xs">
      <SimpleGrid cols={{ base: 1, xs: 2 }}>
        <TrendCard title={title(t("patients:summary.pain"))} trends={pains} max={10} step={5} />
        <TrendCard title={title(t("patients:summary.spadi"))} trends={spadi} max={100} step={50} />
      </SimpleGrid>
      {all.length > 0 && (
        <NumbersTable
          name="pain-spadi"
          title={title(t("patients:summary.painAndSpadi"))}
          table={trendTable(all)}
        />
      )}
    </Stack>
  );
}

/** Return a table with a row for each time at which a trend has a value. */
function trendTable(trends: Trend[]): Schemas["ProgressTable"] {
  const times = [...new Set(trends.flatMap(({ points }) => points.map(({ at }) => at)))].sort();
  return {
    columns: [
      { name: t("assessments:assessments.when"), kind: "moment", digits: 0 },
      ...trends.map(({ name }) => ({ name, kind: "number" as const, digits: 1 })),
    ],
    rows: times.map((at) => [
      at,
      ...trends.map(({ points }) => points.find((point) => point.at === at)?.value ?? null),
    ]),
    texts: [],
  };
}

function TrendCard(props: { title: string; trends: Trend[]; max: number; step: number }) {
  const { title, trends } = props;
  const described = trends.map(({ name, points }) =>
    t("patients:summary.fromTo", {
      name,
      from: formatMeasured(points[0]?.value),
      to: formatMeasured(points.at(-1)?.value),
      count: points.length,
    }),
  );
  return (
    <section aria-label={title}>
      <Title order={2} size="h4">
        {title}
      </Title>
      {trends.length === 0 ? (
        <Text>{t("patients:summary.notMeasured")}</Text>
      ) : (
        <>
          <TrendChart label={described.join(" ")} trends={trends} max={props.max} step={props.step} />
          {trends.length > 1 && <TrendLegend trends={trends} />}
        </>
      )}
    </section>
  );
}

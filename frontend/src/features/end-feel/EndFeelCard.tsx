import "./catalogue";
import { Anchor, Card, Skeleton, Stack, Table, Text } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { api, type Schemas } from "../../lib/api/client";
import { formatDeg, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { Plot } from "../../ui/Plot";
import { ProblemNote } from "../../ui/ProblemNote";
import { ScrolledTable } from "../../ui/ScrolledTable";
import { SimulatedBadge } from "../../ui/SimulatedBadge";
import { TitleWithHelp } from "../../ui/TitleWithHelp";
import { describeStretch } from "./describeResult";

type Test = Schemas["EndFeelRecord"];

/** The result of an end-feel test: figures with intervals, and the curve over earlier ones and beside the other side. */
export function EndFeelCard({ runId }: { runId: string }) {
  const curves = useQuery({ queryKey: ["end-feel", runId], queryFn: () => api.endFeel(runId) });
  const title = t(`endFeel:titles.${curves.data?.result.kind ?? "test"}`);
  return (
    <Card withBorder component="section" aria-label={title}>
      <Stack>
        <TitleWithHelp topic="endFeel" order={2} size="h3">
          {title}
        </TitleWithHelp>
        <ProblemNote error={curves.error} />
        {curves.isPending && <Skeleton h={420} />}
        {curves.data && <Shown curves={curves.data} />}
      </Stack>
    </Card>
  );
}

function Shown({ curves }: { curves: Schemas["EndFeelCurves"] }) {
  const { result, earlier, other_side, figure } = curves;
  const tests = [result, ...earlier, ...(other_side ? [other_side] : [])];
  return (
    <>
      <Text>
        {t("endFeel:measured", {
          motion: translateServerText(result.name, result.name_key),
          side: t(`endFeel:sides.${result.side}`),
          torque: formatDeg(result.torque_nm, 1),
          degPerSecond: formatDeg(result.speed_deg_s, 0),
        })}
      </Text>
      <SimulatedBadge simulated={result.simulated} />
      <Text fw={600}>{t("endFeel:simulatedOnly")}</Text>
      {result.unmeasured && (
        <Text fw={600} data-testid="end-feel-unmeasured">
          {t(`endFeel:unmeasured.${result.unmeasured}`)}
        </Text>
      )}
      {result.stretch && <Text fw={600}>{describeStretch(result.stretch)}</Text>}
      {figure && <Plot figure={figure} label={t("endFeel:figure")} />}
      {figure && <Anchor href={`/api/runs/${result.run_id}/end-feel.csv`}>{t("endFeel:csv")}</Anchor>}
      {result.kind === "test" && <FiguresTable tests={tests} />}
      {result.kind === "test" && <Text size="sm">{t("endFeel:definitions")}</Text>}
    </>
  );
}

const COLUMNS = [
  ["range_deg", 1],
  ["onset_deg", 1],
  ["stiffness_nm_deg", 3],
  ["last_third_nm_deg", 3],
  ["hysteresis_nm", 2],
] as const;

function FiguresTable({ tests }: { tests: Test[] }) {
  return (
    <ScrolledTable minWidth={760}>
      <Table withTableBorder verticalSpacing="xs" data-testid="end-feel-figures">
        <Table.Thead>
          <Table.Tr>
            <Table.Th>{t("endFeel:heads.when")}</Table.Th>
            <Table.Th>{t("endFeel:heads.side")}</Table.Th>
            {COLUMNS.map(([name]) => (
              <Table.Th key={name} ta="right">
                {t(`endFeel:heads.${name}`)}
              </Table.Th>
            ))}
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {tests.map((test) => (
            <Table.Tr key={test.run_id}>
              <Table.Td>{formatMoment(test.started_at)}</Table.Td>
              <Table.Td>{t(`endFeel:sides.${test.side}`)}</Table.Td>
              {COLUMNS.map(([name, digits]) => (
                <Table.Td key={name} ta="right">
                  {withInterval(test.figures?.[name], test.interval?.[name], digits)}
                </Table.Td>
              ))}
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </ScrolledTable>
  );
}

const withInterval = (value: number | undefined, half: number | undefined, digits: number) =>
  value === undefined || half === undefined ? "" : `${formatDeg(value, digits)} ± ${formatDeg(half, digits)}`;

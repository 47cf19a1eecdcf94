import "./catalogue";
import { SimpleGrid, Stack, Text } from "@mantine/core";
import { useMemo } from "react";
import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { Plot } from "../../ui/Plot";
import { NumbersTable } from "../progress/NumbersTable";
import { comparisons, loadsOf, newest, type Response, responseFigure, responseTable } from "./responseCharts";

/**
 * The step responses of the motors, with a chart for each load. A motor whose gains were changed has a chart
 * with its former and its present response, too. Each chart has its table and file.
 */
export function Responses({ responses }: { responses: Response[] }) {
  return (
    <Stack gap="xs">
      {loadsOf(responses).map((load) => (
        <LoadResponses key={load} load={load} responses={responses} />
      ))}
    </Stack>
  );
}

function LoadResponses({ load, responses }: { load: Response["load"]; responses: Response[] }) {
  const { figure, table, compared } = useMemo(() => {
    const own = responses.filter((response) => response.load === load);
    const shown = newest(own);
    return { figure: responseFigure(shown), table: responseTable(shown), compared: comparisons(own) };
  }, [load, responses]);
  const title = t(`commissioning:responses.${load}`);
  return (
    <SimpleGrid cols={{ base: 1, md: compared.length > 0 ? 2 : 1 }} data-testid={`responses-${load}`}>
      {compared.map(({ motor, ...both }) => (
        <Named
          key={motor}
          {...both}
          title={t("commissioning:tuning.motorTitle", { motor })}
          testid={`comparison-${motor}`}
        />
      ))}
      <Named figure={figure} table={table} title={title} testid={`all-${load}`} />
    </SimpleGrid>
  );
}

/** A chart below its title, with its numbers. */
function Named(props: {
  figure: Schemas["Figure"];
  table: Schemas["ProgressTable"];
  title: string;
  testid: string;
}) {
  const { figure, table, title, testid } = props;
  return (
    <Stack gap={4} data-testid={testid}>
      <Text size="sm" fw={600}>
        {title}
      </Text>
      <Plot figure={figure} label={title} />
      <NumbersTable name={testid} title={title} table={table} />
    </Stack>
  );
}

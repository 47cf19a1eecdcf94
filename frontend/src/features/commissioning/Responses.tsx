import "./catalogue";
import { SimpleGrid, Stack, Text } from "@mantine/core";
import { useMemo } from "react";
import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { Plot } from "../../ui/Plot";
import { comparisons, loadsOf, newest, type Response, responseFigure } from "./responseCharts";

/**
 * The step responses of the motors, with a chart for each load. A motor whose gains were changed has a chart
 * with its former and its present response, too. The step's values are shown beside it as numbers.
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
  const { figure, compared } = useMemo(() => {
    const own = responses.filter((response) => response.load === load);
    return { figure: responseFigure(newest(own)), compared: comparisons(own) };
  }, [load, responses]);
  const title = t(`commissioning:responses.${load}`);
  return (
    <SimpleGrid cols={{ base: 1, md: compared.length > 0 ? 2 : 1 }} data-testid={`responses-${load}`}>
      {compared.map(({ motor, figure: both }) => (
        <Named
          key={motor}
          figure={both}
          title={t("commissioning:tuning.motorTitle", { motor })}
          testid={`comparison-${motor}`}
        />
      ))}
      <Named figure={figure} title={title} testid={`all-${load}`} />
    </SimpleGrid>
  );
}

/** A chart below its title. */
function Named({ figure, title, testid }: { figure: Schemas["Figure"]; title: string; testid: string }) {
  return (
    <Stack gap={4} data-testid={testid}>
      <Text size="sm" fw={600}>
        {title}
      </Text>
      <Plot figure={figure} label={title} />
    </Stack>
  );
}

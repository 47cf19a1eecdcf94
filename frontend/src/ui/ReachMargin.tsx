import { Text } from "@mantine/core";
import type { Schemas } from "../lib/api/client";
import { formatDeg } from "../lib/format";
import { t } from "../lib/i18n";
import { translateServerText } from "../lib/serverText";

/** Shows how near a motion comes to the edge of the reachable set, and where. */
export function ReachMargin({ margin }: { margin: Schemas["ReachMargin"] }) {
  const beyond = margin.margin_deg < 0;
  return (
    <Text data-testid="margin" {...(beyond && { fw: 600 })}>
      {t(beyond ? "common:margin.beyond" : "common:margin.within", {
        margin: formatDeg(Math.abs(margin.margin_deg)),
        at: margin.at_s.toFixed(1),
        quantity: translateServerText(margin.quantity, margin.quantity_key),
        value: formatDeg(margin.value_deg),
        limit: formatDeg(margin.limit_deg),
      })}
    </Text>
  );
}

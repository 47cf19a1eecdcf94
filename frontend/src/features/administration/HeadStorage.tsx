import "./catalogue";
import { Alert, Text } from "@mantine/core";
import { IconInfoCircle } from "@tabler/icons-react";
import type { Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";

/** Shows where the heads of the trail are stored, and what this storage does not prove. */
export function HeadStorage({ heads }: { heads: Schemas["AuditHeads"] }) {
  const others = [
    ...heads.elsewhere.map((file) => t("administration:audit.storedIn", { file })),
    ...(heads.other_stations ? [t("administration:audit.storedAtStations")] : []),
    ...(heads.log ? [t("administration:audit.storedInLog")] : []),
  ];
  return (
    <>
      {others.length > 0 ? (
        <Text data-testid="audit-heads">
          {t("administration:audit.stored")} {others.join(" ")}
        </Text>
      ) : (
        <Alert color="grape" variant="light" icon={<IconInfoCircle />} data-testid="audit-heads">
          {t("administration:audit.onlyHere")}
        </Alert>
      )}
      {heads.failing_since && (
        <Alert
          color="grape"
          variant="light"
          icon={<IconInfoCircle />}
          role="alert"
          data-testid="audit-copy-failing"
        >
          {t("administration:audit.copyFailing", {
            file: heads.copy_file ?? "",
            since: formatMoment(heads.failing_since),
          })}
        </Alert>
      )}
    </>
  );
}

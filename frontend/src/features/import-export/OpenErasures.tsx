import "./catalogue";
import { Alert, Group } from "@mantine/core";
import { IconInfoCircle } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { api } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { PageLink } from "../../ui/links";

/** Erasure requests without a decision. Renders nothing if there are none. */
export function OpenErasures() {
  const open = useQuery({ queryKey: ["erasures"], queryFn: () => api.openErasures() });
  const items = open.data?.items ?? [];
  if (items.length === 0) return null;
  return (
    <Alert color="grape" variant="light" icon={<IconInfoCircle />} title={t("import-export:erasure.open")}>
      <Group gap="lg">
        {items.map((request) => (
          <PageLink key={request.id} to="/patients/$patientId" params={{ patientId: request.patient_id }}>
            {t("import-export:erasure.requestedOn", { moment: formatMoment(request.asked_at) })}
          </PageLink>
        ))}
      </Group>
    </Alert>
  );
}

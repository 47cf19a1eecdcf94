import { Button, Group, Table, Text } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { type Assessment, api } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import { ScrolledTable } from "../../ui/ScrolledTable";
import { RequirePermission } from "../auth/RequirePermission";
import { formatScore } from "./messages";

/** All assessments, newest first, including withdrawn ones. */
export function AssessmentTable(props: {
  episodeId: string;
  items: Assessment[];
  onEdit: (assessment: Assessment) => void;
}) {
  const queries = useQueryClient();
  const [confirming, setConfirming] = useState<string | null>(null);
  const withdraw = useMutation({
    mutationFn: (assessment: Assessment) => api.withdrawAssessment(assessment.id, assessment.updated_at),
    onSettled: () => {
      setConfirming(null);
      void queries.invalidateQueries({ queryKey: ["assessments", props.episodeId] });
      void queries.invalidateQueries({ queryKey: ["progress", props.episodeId] });
    },
  });
  return (
    <>
      <ProblemNote error={withdraw.error} />
      <ScrolledTable minWidth={640}>
        <Table verticalSpacing="xs" aria-label={t("assessments:assessments.title")}>
          <Table.Thead>
            <Table.Tr>
              <Table.Th>{t("assessments:assessments.when")}</Table.Th>
              <Table.Th>{t("assessments:assessments.by")}</Table.Th>
              <Table.Th ta="right">{t("assessments:assessments.angles")}</Table.Th>
              <Table.Th ta="right">{t("assessments:assessments.averagePain")}</Table.Th>
              <Table.Th ta="right">{t("assessments:assessments.spadi")}</Table.Th>
              <Table.Th />
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {props.items.map((assessment) => (
              <Table.Tr key={assessment.id} {...(assessment.withdrawn_at && { c: "dimmed" })}>
                <Table.Td {...(assessment.withdrawn_at && { td: "line-through" })}>
                  {formatMoment(assessment.assessed_at)}
                </Table.Td>
                <Table.Td>{assessment.assessed_by}</Table.Td>
                <Table.Td ta="right">{assessment.rom.length}</Table.Td>
                <Table.Td ta="right">{assessment.pain_average ?? "–"}</Table.Td>
                <Table.Td ta="right">{formatScore(assessment.spadi_score?.total)}</Table.Td>
                <Table.Td>
                  {assessment.withdrawn_at ? (
                    <Text size="sm">{t("assessments:assessments.withdrawn")}</Text>
                  ) : confirming === assessment.id ? (
                    <Group gap="xs" justify="end">
                      <Button variant="default" onClick={() => setConfirming(null)}>
                        {t("assessments:assessments.keep")}
                      </Button>
                      <Button loading={withdraw.isPending} onClick={() => withdraw.mutate(assessment)}>
                        {t("assessments:assessments.confirmWithdrawal")}
                      </Button>
                    </Group>
                  ) : (
                    <RequirePermission permission="write_records">
                      <Group gap="xs" justify="end">
                        <Button variant="default" onClick={() => props.onEdit(assessment)}>
                          {t("assessments:assessments.change")}
                        </Button>
                        <Button variant="subtle" onClick={() => setConfirming(assessment.id)}>
                          {t("assessments:assessments.withdraw")}
                        </Button>
                      </Group>
                    </RequirePermission>
                  )}
                </Table.Td>
              </Table.Tr>
            ))}
          </Table.Tbody>
        </Table>
      </ScrolledTable>
    </>
  );
}

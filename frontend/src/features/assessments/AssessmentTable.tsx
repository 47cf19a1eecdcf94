import { Button, Group, Table, Text } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { type Assessment, api } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { ProblemNote } from "../../ui/ProblemNote";
import { RequirePermission } from "../auth/RequirePermission";
import { ASSESSMENTS, formatScore } from "./messages";

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
      <Table verticalSpacing="xs" aria-label={ASSESSMENTS.title}>
        <Table.Thead>
          <Table.Tr>
            <Table.Th>{ASSESSMENTS.when}</Table.Th>
            <Table.Th>{ASSESSMENTS.by}</Table.Th>
            <Table.Th ta="right">{ASSESSMENTS.angles}</Table.Th>
            <Table.Th ta="right">{ASSESSMENTS.averagePain}</Table.Th>
            <Table.Th ta="right">{ASSESSMENTS.spadi}</Table.Th>
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
                  <Text size="sm">{ASSESSMENTS.withdrawn}</Text>
                ) : confirming === assessment.id ? (
                  <Group gap="xs" justify="end">
                    <Button variant="default" onClick={() => setConfirming(null)}>
                      {ASSESSMENTS.keep}
                    </Button>
                    <Button loading={withdraw.isPending} onClick={() => withdraw.mutate(assessment)}>
                      {ASSESSMENTS.withdrawSurely}
                    </Button>
                  </Group>
                ) : (
                  <RequirePermission permission="write_records">
                    <Group gap="xs" justify="end">
                      <Button variant="default" onClick={() => props.onEdit(assessment)}>
                        {ASSESSMENTS.change}
                      </Button>
                      <Button variant="subtle" onClick={() => setConfirming(assessment.id)}>
                        {ASSESSMENTS.withdraw}
                      </Button>
                    </Group>
                  </RequirePermission>
                )}
              </Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </>
  );
}

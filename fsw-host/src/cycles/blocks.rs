//! What each block costs.

use super::CycleError;
use super::counts::Block;
use super::listing::{Instruction, Listing};
use super::registers::{base_mnemonic, is_conditional_branch};
use super::{mca, published};

/// One block's cost per execution.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct BlockCost {
    /// The function that it lies in.
    pub function: String,
    pub instructions: u64,
    /// Cycles by LLVM's model.
    pub llvm: u32,
    /// Cycles by published measurements.
    pub published: u32,
    pub conditional_branch: bool,
    /// Instructions that LLVM's model lacks.
    pub stand_ins: Vec<String>,
    /// Whether its instructions are in the listing; otherwise its cycles are a mean.
    pub listed: bool,
}

/// The cost of every block.
pub(super) fn costs(listing: &Listing, blocks: &[Block]) -> Result<Vec<BlockCost>, CycleError> {
    let texts: Vec<Option<&[Instruction]>> =
        blocks.iter().map(|block| listing.block(block.start, block.instructions)).collect();
    let listed: Vec<&[Instruction]> = texts.iter().copied().flatten().collect();
    let verdict = mca::cycles(&listed)?;
    Ok(merge(listing, blocks, &texts, &verdict))
}

/// Puts the figures of the listed blocks to all blocks, in order.
fn merge(
    listing: &Listing,
    blocks: &[Block],
    texts: &[Option<&[Instruction]>],
    verdict: &mca::Verdict,
) -> Vec<BlockCost> {
    let listed_instructions: usize = texts.iter().copied().flatten().map(<[Instruction]>::len).sum();
    let mut llvm = verdict.cycles.iter().copied();
    let mut costs = Vec::with_capacity(blocks.len());
    for (block, text) in blocks.iter().zip(texts) {
        let mut cost = BlockCost {
            function: listing.function_at(block.start).to_owned(),
            instructions: block.instructions as u64,
            ..BlockCost::default()
        };
        if let Some(text) = text {
            cost.listed = true;
            cost.llvm = llvm.next().unwrap_or_default();
            cost.published = published::cycles(text);
            cost.conditional_branch = text.last().is_some_and(|last| is_conditional_branch(base_mnemonic(last)));
            let lacking = text.iter().filter(|instruction| verdict.lacking.contains(&instruction.mnemonic));
            cost.stand_ins = lacking.map(|instruction| instruction.mnemonic.clone()).collect();
        }
        costs.push(cost);
    }
    let sum = |figure: fn(&BlockCost) -> u32| costs.iter().map(|cost| u64::from(figure(cost))).sum::<u64>();
    let (llvm, published) = (sum(|cost| cost.llvm), sum(|cost| cost.published));
    let mean = |cycles: u64, instructions: u64| (cycles * instructions).div_ceil((listed_instructions as u64).max(1));
    for cost in costs.iter_mut().filter(|cost| !cost.listed) {
        cost.llvm = mean(llvm, cost.instructions) as u32;
        cost.published = mean(published, cost.instructions) as u32;
    }
    costs
}

#[cfg(test)]
mod tests {
    use super::super::listing::tests::LISTING;
    use super::*;

    #[test]
    fn figures_go_to_the_blocks_in_order_and_a_block_that_is_not_listed_costs_the_mean_per_instruction() {
        let listing = Listing::parse(LISTING).unwrap();
        let at = |start, instructions| Block { start, instructions };
        let blocks = [at(0x404, 2), at(0x2000_0000, 3), at(0x408, 5)];
        let texts: Vec<_> = blocks.iter().map(|block| listing.block(block.start, block.instructions)).collect();
        let verdict = mca::Verdict { cycles: vec![4, 17], lacking: ["ite".to_owned()].into() };
        let costs = merge(&listing, &blocks, &texts, &verdict);
        let llvm: Vec<u32> = costs.iter().map(|cost| cost.llvm).collect();
        assert_eq!(llvm, [4, 9, 17], "21 cycles in 7 instructions are 3 each");
        assert_eq!(costs.iter().map(|cost| cost.listed).collect::<Vec<_>>(), [true, false, true]);
        assert_eq!(costs[2].stand_ins, ["ite"]);
        assert!(costs[2].conditional_branch, "it ends with cbz");
        assert_eq!(costs[0].function, "core::entry");
    }
}
